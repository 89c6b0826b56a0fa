// Keeps the files of the pages, so that an installed dashboard opens without its server and says that the connection is lost.
// The server is always asked first: what it answers is newer. Nothing of /api/ is ever kept.

const SHELL = "shell";

/** Pages may carry a token in their address: it is no part of the key. */
const keyOf = (url) => { const { origin, pathname } = new URL(url); return origin + pathname; };
const isShell = (url) => { const { origin, pathname } = new URL(url); return origin === location.origin && !pathname.startsWith("/api/"); };

addEventListener("install", () => skipWaiting());
addEventListener("activate", (event) => event.waitUntil(clients.claim()));

addEventListener("message", ({ data }) => {
  caches.open(SHELL).then((shell) => Promise.all(data.filter(isShell).map(async (url) => {
    const answer = await fetch(url);
    if (answer.ok) await shell.put(keyOf(url), answer);
  }))).catch(() => {});
});

addEventListener("fetch", (event) => {
  if (event.request.method !== "GET" || !isShell(event.request.url)) return;
  event.respondWith(fetch(event.request).catch(async (error) => {
    const kept = await caches.match(keyOf(event.request.url));
    if (kept) return kept;
    throw error;
  }));
});
