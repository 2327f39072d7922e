// Of a button that acts at most once at a time: it keeps the focus meanwhile, which one that is disabled gives away.
export const unlessBusy = (busy, act) => ({ "aria-disabled": busy, onClick: busy ? null : act });
