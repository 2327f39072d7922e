// The days of the week, 1 Monday to 7 Sunday, in the reader's language.
import { dateFormat } from "../language.js";

const DAY = dateFormat({ weekday: "short", timeZone: "UTC" });

export const WEEKDAYS = [1, 2, 3, 4, 5, 6, 7];

export const weekdayName = (day) => DAY.format(new Date(Date.UTC(2024, 0, day, 12)));
