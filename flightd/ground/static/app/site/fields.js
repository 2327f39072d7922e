// What each table of a site file holds: key, words, kind of input.  Ranges and sense are the station's to judge.
import { english } from "../language.js";

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

const ENDS = [node("nodes", english("From node"), 0), node("nodes", english("To node"), 1)];
const DICTIONARIES = ["4x4_50", "4x4_250", "5x5_100", "6x6_250", "apriltag_16h5", "apriltag_36h11"];

export const FIELDS = {
  site: [
    text("name", english("Name")),
    { key: "line_colour", words: english("Colour of the paint"), kind: "paint", normal: "yellow" },
    number("line_width_m", english("Width of the paint"), M, "0.075"),
    number("ceiling_m", english("Lowest thing under the roof"), M, english("not measured")),
    check("interlock", english("Arm only while an interlock says the aisles are closed"), false),
    check("unattended_start", english("Schedules may start drones without a person"), false),
  ],
  aisle: [
    text("id", english("Letters")),
    number("x_m", english("First node, x")),
    number("y_m", english("Line, y")),
    { key: "pitch", words: english("Pitch from the aisle before"), kind: "pitch", unit: M },
    numbers("spacing_m", english("Distances from node to node")),
    sides("shelves", english("Shelves, seen along +x")),
    number("shelf_distance_m", english("Line to shelf front"), M, "1.2"),
    number("shelf_height_m", english("Height of the shelves"), M, "3"),
    number("cross_half_m", english("Half a node's own cross line"), M, "0.5"),
    number("overrun_m", english("Line runs past its end nodes by"), M, "0.4"),
    choice("one_way", english("Flown"), [["", english("both ways")], ["+x", english("along +x only")], ["-x", english("along −x only")]], ""),
  ],
  cross: [...ENDS, check("one_way", english("Flown from the first node to the second only"), false)],
  blocked: ENDS,
  keep_out: [
    number("x0_m", english("From x")), number("x1_m", english("To x")), number("y0_m", english("From y")), number("y1_m", english("To y")),
    number("from_m", english("From height"), M, english("floor")), number("to_m", english("To height"), M, english("ceiling")),
  ],
  rack: [
    { key: "aisles", words: english("Aisles"), kind: "aisles" },
    sides("sides", english("Sides, seen along +x")),
    number("bay_width_m", english("Width of a bay")),
    numbers("levels_m", english("Heights of the labels")),
    whole("positions", english("Places in a bay on each level"), "1"),
    text("pattern", english("Pattern of location codes"), "{aisle}{side}-{bay:02}-{level}-{position}"),
    number("deck_below_label_m", english("Goods stand below their label by"), M, english("2/5 of the spacing")),
  ],
  pad: [
    text("id", english("Name")),
    node("node", english("On node")),
    number("size_m", english("Side"), M, "0.5"),
    part("offset_m", english("Off the node, x"), 0), part("offset_m", english("Off the node, y"), 1),
    check("start", english("Missions may start here"), true),
    check("charge", english("Batteries are charged or changed here"), true),
    choice("sign", english("Found by"), [["mat", english("its own mat")], ["line_end", english("the end of a painted line")]], "mat"),
  ],
  marker: [
    whole("id", english("Number")),
    choice("dictionary", english("Dictionary"), DICTIONARIES.map((one) => [one, one]), ""),
    number("x_m", english("Centre, x")), number("y_m", english("Centre, y")),
    number("size_m", english("Side of the black square"), M, "0.2"),
    number("yaw_deg", english("Turned, clockwise"), "°", "0"),
  ],
};

export const GROUPS = {
  aisle: english("Aisles"), cross: english("Crosses"), rack: english("Racks"), pad: english("Pads"), keep_out: english("Keep-outs"), blocked: english("Blocked lines"), marker: english("Markers"),
};
export const ONE_OF = {
  aisle: english("aisle"), cross: english("cross"), rack: english("rack"), pad: english("pad"), keep_out: english("keep-out"), blocked: english("blocked line"), marker: english("marker"),
};
export const REMOVE = {
  aisle: english("Remove aisle"), cross: english("Remove cross"), rack: english("Remove rack"), pad: english("Remove pad"),
  keep_out: english("Remove keep-out"), blocked: english("Remove blocked line"), marker: english("Remove marker"),
};
