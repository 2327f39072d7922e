// The page Fleet: all drones of a station together.
export default {
  "Fleet": "Flotte",
  "{n} drone|{n} drones": "{n} Drohne|{n} Drohnen",
};
