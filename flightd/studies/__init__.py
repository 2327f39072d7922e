"""Vision on folders of frames: detect, evaluate, bench, train, overlays."""
