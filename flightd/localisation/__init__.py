"""Where on the grid: a filter over hypotheses, its observations, landmarks and pads."""
