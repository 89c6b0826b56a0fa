// Checks pages with axe-core for readers with low vision and for use without a mouse.

import { readFileSync } from "node:fs";
import { join } from "node:path";

import { AT } from "./browser.mjs";

const AXE = readFileSync(join(AT, "node_modules", "axe-core", "axe.min.js"), "utf8");

/** The serious and critical findings of a page, a line each. */
export async function findings(page) {
  // The content security policy allows only scripts of the server: axe is injected as the browser's own tools are.
  await page.evaluate(AXE);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  return violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes.slice(0, 3).map(({ target, failureSummary }) => `${target} ${failureSummary.split("\n")[1] ?? ""}`).join("; ")}`);
}
