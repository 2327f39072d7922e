"""The messages of VDA 5050: one model, written and read as versions 2.1 and 3.0 have them."""
