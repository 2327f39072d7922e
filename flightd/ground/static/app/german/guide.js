// Around the guide, whose pages are English.
export default {
  "All pages": "Alle Seiten",
  "Pages before and after": "Seiten davor und danach",
  "Before": "Davor",
  "After": "Danach",
  "On this page": "Auf dieser Seite",
  "Search the guide": "Im Handbuch suchen",
  "Search the guide  ( / )": "Im Handbuch suchen  ( / )",
  "Page": "Seite",
  "choose a page": "Seite wählen",
  "Searching …": "Suche läuft …",
  "Nothing in the guide holds “{words}”": "Nichts im Handbuch enthält „{words}“",
};
