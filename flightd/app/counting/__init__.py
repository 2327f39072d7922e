"""What a flight that counts shelves needs beside the tick: readers, store, writer."""
