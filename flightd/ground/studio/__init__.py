"""The page Studio: pictures in which people show paint and floor, profiles learnt from them, their scores."""
