// What is asked of the server.

// A plus that a person pasted means a plus: no token has spaces.
const token = new URLSearchParams(location.search).get("token")?.replaceAll(" ", "+");
const headers = token ? { Authorization: `Bearer ${token}` } : {};

/** An address that cannot be sent headers of its own. */
export const withToken = (path) => (token ? `${path}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(token)}` : path);

async function answer(response) {
  const said = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(said.error ?? response.statusText);
  return said;
}

/** What stands at a path; throws what the server says against it. */
export async function get(path) {
  return answer(await fetch(path, { headers }));
}

/** Asks for something to be done; throws what the server says against it. */
export async function ask(path, body) {
  return answer(await fetch(path, {
    method: "POST", headers: { "Content-Type": "application/json", ...headers }, body: JSON.stringify(body),
  }));
}

/** Sends a file; throws what the server says against it. */
export async function send(path, file) {
  return answer(await fetch(path, { method: "POST", headers: { "Content-Type": "application/octet-stream", ...headers }, body: file }));
}

/** Gives an order as the prompt understands it. */
export const order = (line) => ask("/api/orders", { line });

/** The same when the page may be gone before there is an answer. */
export function orderAtOnce(line) {
  fetch("/api/orders", {
    method: "POST", keepalive: true, headers: { "Content-Type": "application/json", ...headers }, body: JSON.stringify({ line }),
  }).catch(() => {});
}
