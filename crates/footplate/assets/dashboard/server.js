// Requests to the server.

import { logged } from "./words.js";

// A pasted `+` is a plus sign: tokens have no spaces.
const token = new URLSearchParams(location.search).get("token")?.replaceAll(" ", "+");
const headers = token ? { Authorization: `Bearer ${token}` } : {};

/** The address of a request without headers. */
export const withToken = (path) => (token ? `${path}${path.includes("?") ? "&" : "?"}token=${encodeURIComponent(token)}` : path);

async function answer(response) {
  const said = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(said.error ? logged(said.error) : response.statusText);
  return said;
}

/** Fetches a path; throws the server's error message. */
export async function get(path) {
  return answer(await fetch(path, { headers }));
}

/** Posts a request; throws the server's error message. */
export async function ask(path, body) {
  return answer(await fetch(path, {
    method: "POST", headers: { "Content-Type": "application/json", ...headers }, body: JSON.stringify(body),
  }));
}

/** Sends a file; throws the server's error message. */
export async function send(path, file) {
  return answer(await fetch(path, { method: "POST", headers: { "Content-Type": "application/octet-stream", ...headers }, body: file }));
}

/** Sends a line in the syntax of the prompt. */
export const order = (line) => ask("/api/orders", { line });

/** The same for a page that may close before the answer arrives. */
export function orderAtOnce(line) {
  fetch("/api/orders", {
    method: "POST", keepalive: true, headers: { "Content-Type": "application/json", ...headers }, body: JSON.stringify({ line }),
  }).catch(() => {});
}
