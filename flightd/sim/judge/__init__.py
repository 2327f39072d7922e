"""How good and how safe a flight was, by the truth."""
