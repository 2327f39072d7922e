// What each table of a site file holds: key, words, kind of input.  Ranges and sense are the station's to judge.
const M = "m";

const number = (key, words, unit = M, placeholder = "") => ({ key, words, kind: "number", unit, placeholder });
const whole = (key, words, placeholder = "") => ({ key, words, kind: "number", unit: "", placeholder });
const text = (key, words, placeholder = "") => ({ key, words, kind: "text", placeholder });
const numbers = (key, words) => ({ key, words, kind: "numbers", unit: M });
const check = (key, words, normal) => ({ key, words, kind: "check", normal });
const choice = (key, words, options, normal) => ({ key, words, kind: "choice", options, normal });
const sides = (key, words) => ({ key, words, kind: "sides" });
const node = (key, words, at = null) => ({ key, words, kind: "node", at });
const part = (key, words, at) => ({ key, words, kind: "part", at, unit: M });

const ENDS = [node("nodes", "From node", 0), node("nodes", "To node", 1)];
const DICTIONARIES = ["4x4_50", "4x4_250", "5x5_100", "6x6_250", "apriltag_16h5", "apriltag_36h11"];

export const FIELDS = {
  site: [
    text("name", "Name"),
    choice("line_colour", "Colour of the paint", ["yellow", "white", "red", "blue"].map((one) => [one, one]), "yellow"),
    number("line_width_m", "Width of the paint", M, "0.075"),
    number("ceiling_m", "Lowest thing under the roof", M, "not measured"),
    check("interlock", "Arm only while an interlock says the aisles are closed", false),
  ],
  aisle: [
    text("id", "Letters"),
    number("x_m", "First node, x"),
    number("y_m", "Line, y"),
    { key: "pitch", words: "Pitch from the aisle before", kind: "pitch", unit: M },
    numbers("spacing_m", "Distances from node to node"),
    sides("shelves", "Shelves, seen along +x"),
    number("shelf_distance_m", "Line to shelf front", M, "1.2"),
    number("shelf_height_m", "Height of the shelves", M, "3"),
    number("cross_half_m", "Half a node's own cross line", M, "0.5"),
    number("overrun_m", "Line runs past its end nodes by", M, "0.4"),
    choice("one_way", "Flown", [["", "both ways"], ["+x", "along +x only"], ["-x", "along −x only"]], ""),
  ],
  cross: [...ENDS, check("one_way", "Flown from the first node to the second only", false)],
  blocked: ENDS,
  keep_out: [
    number("x0_m", "From x"), number("x1_m", "To x"), number("y0_m", "From y"), number("y1_m", "To y"),
    number("from_m", "From height", M, "floor"), number("to_m", "To height", M, "ceiling"),
  ],
  rack: [
    { key: "aisles", words: "Aisles", kind: "aisles" },
    sides("sides", "Sides, seen along +x"),
    number("bay_width_m", "Width of a bay"),
    numbers("levels_m", "Heights of the labels"),
    whole("positions", "Places in a bay on each level", "1"),
    text("pattern", "Pattern of location codes", "{aisle}{side}-{bay:02}-{level}-{position}"),
    number("deck_below_label_m", "Goods stand below their label by", M, "2/5 of the spacing"),
  ],
  pad: [
    text("id", "Name"),
    node("node", "On node"),
    number("size_m", "Side", M, "0.5"),
    part("offset_m", "Off the node, x", 0), part("offset_m", "Off the node, y", 1),
    check("start", "Missions may start here", true),
    check("charge", "Batteries are charged or changed here", true),
    choice("sign", "Found by", [["mat", "its own mat"], ["line_end", "the end of a painted line"]], "mat"),
  ],
  marker: [
    whole("id", "Number"),
    choice("dictionary", "Dictionary", DICTIONARIES.map((one) => [one, one]), ""),
    number("x_m", "Centre, x"), number("y_m", "Centre, y"),
    number("size_m", "Side of the black square", M, "0.2"),
    number("yaw_deg", "Turned, clockwise", "°", "0"),
  ],
};

export const GROUPS = {
  aisle: "Aisles", cross: "Crosses", rack: "Racks", pad: "Pads", keep_out: "Keep-outs", blocked: "Blocked lines", marker: "Markers",
};
export const ONE_OF = {
  aisle: "aisle", cross: "cross", rack: "rack", pad: "pad", keep_out: "keep-out", blocked: "blocked line", marker: "marker",
};
