"""Labelled frames with exact truth at three levels of difficulty."""
