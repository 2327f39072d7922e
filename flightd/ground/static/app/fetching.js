// What the station answers to a question, as JSON.  An Error with its words where it refuses.
export async function askJson(url) {
  const answer = await fetch(url);
  const told = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(told.refused ?? `the ground station answers ${answer.status}`);
  return told;
}
