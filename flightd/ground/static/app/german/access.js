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
  "End of the session": "Ende der Anmeldung",
  "Your session ends in {n} minute.|Your session ends in {n} minutes.": "Ihre Anmeldung endet in {n} Minute.|Ihre Anmeldung endet in {n} Minuten.",
  "Sign in again": "Neu anmelden",
  "Password of {name}": "Passwort von {name}",
  "Your session has ended, and a drone flies. STOP and Pause stay yours, and this page attends, until it has landed.": "Ihre Anmeldung ist abgelaufen, und eine Drohne fliegt. STOP und Pause behalten Sie, und diese Seite führt die Aufsicht, bis sie gelandet ist.",
  "Your session has ended, and a drone flies. STOP and Pause stay yours until it has landed.": "Ihre Anmeldung ist abgelaufen, und eine Drohne fliegt. STOP und Pause behalten Sie, bis sie gelandet ist.",
};
