// The pages of the station.  Each lies in a folder of its own and is fetched when it is first shown.
//
// `path` is where it is, with everything below it; `load` gives the module whose `default` is its component,
// called with {route}; `styles` are its own, over and above base.css and frame.css.
export const PAGES = [
  {
    path: "/",
    title: "Live",
    styles: ["live.css", "map.css"],
    load: () => import("./live/live_page.js"),
  },
  {
    path: "/stock",
    title: "Stock",
    styles: ["stock.css"],
    load: () => import("./stock/stock_page.js"),
  },
  {
    path: "/missions",
    title: "Missions",
    styles: ["live.css", "map.css", "missions.css"],
    load: () => import("./missions/missions_page.js"),
  },
  {
    path: "/flights",
    title: "Flights",
    styles: ["live.css", "map.css", "../vendor/uplot.css", "flights.css", "replay.css"],
    load: () => import("./flights/flights_page.js"),
  },
  {
    path: "/studio",
    title: "Studio",
    styles: ["doctor.css", "studio.css", "exposure.css"],
    load: () => import("./studio/studio_page.js"),
  },
  {
    path: "/site",
    title: "Site",
    styles: ["map.css", "site.css"],
    load: () => import("./site/site_page.js"),
  },
  {
    path: "/doctor",
    title: "Doctor",
    styles: ["doctor.css"],
    load: () => import("./doctor/doctor_page.js"),
  },
  {
    path: "/guide",
    title: "Guide",
    styles: ["guide.css"],
    load: () => import("./guide/guide_page.js"),
  },
];

// Shown in the place of every page while somebody has to sign in.
export const SIGN_IN = {
  title: "Sign in",
  styles: ["access.css"],
  load: () => import("./access/sign_in.js"),
};

// The page at a path, or undefined: the longest one that it lies under.
export function pageAt(path) {
  const under = PAGES.filter((page) => path === page.path || (page.path !== "/" && path.startsWith(`${page.path}/`)));
  return under.sort((a, b) => b.path.length - a.path.length)[0];
}
