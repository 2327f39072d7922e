"""The page Site: maps that are drawn, checked and saved in the browser."""
