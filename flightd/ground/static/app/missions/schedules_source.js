// The schedules of a site, as the station keeps them.
import { newId } from "../acts.js";
import { askJson, isGivenUp } from "../fetching.js";
import { change, missions } from "./missions_state.js";

const JSON_BODY = { "Content-Type": "application/json" };

export async function loadSchedules() {
  const { site } = missions();
  try {
    const { kept, schedules } = await askJson(`/api/schedules?site=${encodeURIComponent(site)}`);
    if (missions().site === site) change({ schedules: { kept, list: schedules } });
  } catch (error) {
    if (!isGivenUp(error)) change({ scheduleTrouble: error.message });
  }
}

async function sent(method, id, body) {
  const options = { method, headers: JSON_BODY, goesOn: true, ...(body && { body: JSON.stringify(body) }) };
  try {
    await askJson(`/api/schedules/${id}`, options);
    change({ scheduleTrouble: "" });
    return true;
  } catch (error) {
    change({ scheduleTrouble: error.message });
    return false;
  } finally {
    loadSchedules();
  }
}

export const keepSchedule = (kept) => sent("PUT", newId(), { site: missions().site, ...kept });

export const removeSchedule = ({ id }) => sent("DELETE", id);

// The same schedule, which starts nothing while it is not enabled.
export function enableSchedule({ id, since_ns, next, newest, trouble, ...kept }, enabled) {
  return sent("PUT", id, { ...kept, enabled });
}
