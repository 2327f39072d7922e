// The pages of the station.  Each lies in a folder of its own and is fetched when it is first shown.
//
// `path` is where it is, with everything below it; `load` gives the module whose `default` is its component,
// called with {route}; `styles` are its own, over and above base.css and frame.css.
import { english } from "./language.js";

export const PAGES = [
  {
    path: "/",
    title: english("Live"),
    styles: ["live.css", "map.css"],
    load: () => import("./live/live_page.js"),
  },
  {
    path: "/fleet",
    title: english("Fleet"),
    styles: ["map.css", "missions.css", "fleet.css"],
    load: () => import("./fleet/fleet_page.js"),
  },
  {
    path: "/stock",
    title: english("Stock"),
    styles: ["stock.css"],
    load: () => import("./stock/stock_page.js"),
  },
  {
    path: "/missions",
    title: english("Missions"),
    styles: ["live.css", "map.css", "missions.css"],
    load: () => import("./missions/missions_page.js"),
  },
  {
    path: "/flights",
    title: english("Flights"),
    styles: ["live.css", "map.css", "../vendor/uplot.css", "flights.css", "replay.css"],
    load: () => import("./flights/flights_page.js"),
  },
  {
    path: "/studio",
    title: english("Studio"),
    styles: ["doctor.css", "studio.css", "exposure.css"],
    load: () => import("./studio/studio_page.js"),
  },
  {
    path: "/site",
    title: english("Site"),
    styles: ["map.css", "site.css"],
    load: () => import("./site/site_page.js"),
  },
  {
    path: "/doctor",
    title: english("Doctor"),
    styles: ["doctor.css"],
    load: () => import("./doctor/doctor_page.js"),
  },
  {
    path: "/guide",
    title: english("Guide"),
    styles: ["guide.css"],
    load: () => import("./guide/guide_page.js"),
  },
];

// Shown in the place of every page while somebody has to sign in.
export const SIGN_IN = {
  title: english("Sign in"),
  styles: ["access.css"],
  load: () => import("./access/sign_in.js"),
};

// The page at a path, or undefined: the longest one that it lies under.
export function pageAt(path) {
  const under = PAGES.filter((page) => path === page.path || (page.path !== "/" && path.startsWith(`${page.path}/`)));
  return under.sort((a, b) => b.path.length - a.path.length)[0];
}
