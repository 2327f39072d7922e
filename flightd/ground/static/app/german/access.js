// Signing in and out.
export default {
  "Signed in as {name}": "Angemeldet als {name}",
  "Sign out": "Abmelden",
  "Type your name first.": "Geben Sie zuerst Ihren Namen ein.",
  "Type your password first.": "Geben Sie zuerst Ihr Passwort ein.",
  "This ground station asks who you are. It shows nothing before.": "Diese Bodenstation fragt, wer Sie sind. Vorher zeigt sie nichts.",
  "Password": "Passwort",
  "Signing in …": "Anmeldung läuft …",
  "No name yet, or a forgotten password? Whoever runs the station can help.": "Noch kein Name, oder das Passwort vergessen? Wer die Station betreibt, kann helfen.",
};
