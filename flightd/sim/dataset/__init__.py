"""Labelled frames with exact truth at four levels of difficulty."""
