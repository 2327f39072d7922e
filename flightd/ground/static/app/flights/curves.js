// The curves of a flight as they come from the station: fetched anew whenever another stretch of time is shown.
import { askJson } from "../fetching.js";
import { useEffect, useState } from "../html.js";

const STRETCHES = 700;

// The series of the flight between two of its times; null before it came.  A failure leaves the last one.
export function useSeries(id, from, to) {
  const [series, setSeries] = useState(null);
  useEffect(() => {
    if (!id || !(to > from)) return undefined;
    let wanted = true;
    askJson(`/api/flights/${id}/series?from=${from}&to=${to}&stretches=${STRETCHES}`)
      .then((told) => wanted && setSeries(told))
      .catch(() => {});
    return () => {
      wanted = false;
    };
  }, [id, from, to]);
  return series;
}

// The times of a series, moved by `shift` seconds.
export function timesOf(series, shift = 0) {
  const length = Object.values(series.curves)[0]?.length ?? 0;
  return Float64Array.from({ length }, (_, i) => series.from_s + i * series.step_s + shift);
}

export function scaled(series, key, scale = 1) {
  return (series.curves[key] ?? []).map((value) => (value == null ? null : value * scale));
}
