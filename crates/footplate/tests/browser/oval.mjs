// An oval with a siding, drawn in the editor from nothing: pieces of Märklin C track, two turnouts, four sensors.

import assert from "node:assert/strict";

/** Clicks the joint of a kind that is nearest to a point of the drawing (mm). */
export async function pressJoint(page, kind, x, y) {
  const joints = page.locator(`#draft .joint.${kind}`);
  const nth = await page.$$eval(`#draft .joint.${kind}`, (all, [x, y]) => {
    const away = (joint) => Math.hypot(joint.cx.baseVal.value - x, joint.cy.baseVal.value - y);
    return all.indexOf([...all].sort((one, other) => away(one) - away(other))[0]);
  }, [x, y]);
  await joints.nth(nth).scrollIntoViewIfNeeded();
  const box = await joints.nth(nth).boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
}

/** Draws it on an editor page that is empty. */
export async function drawOval(page) {
  const lay = async (...names) => {
    for (const name of names) await page.locator("#pieces button", { hasText: name }).first().click();
  };
  const joints = (kind) => page.locator(`#draft .joint.${kind}`);
  const says = () => page.locator("#draft-says").textContent();
  await page.click("#hand-right");
  await lay("24611/24612", "24172", "24188", "24188", "24172");
  // The track joins the other turnout at its straight leg; both curved legs are on the same side.
  await page.click("#hand-left");
  await page.selectOption("#joined-at", { label: "the straight leg" });
  await lay("24611/24612");
  await page.click("#hand-right");
  const half = ["24130", "24130", "24130", "24130", "24130", "24130"];
  await lay(...half, "24188", "24172", "24188", "24188", "24172", "24188");
  assert.equal(await joints("open").count(), 4);
  // Undo removes a piece, redo restores it.
  await lay("24094");
  await page.click("#draft-undo");
  await lay(...half);
  assert.equal(await joints("open").count(), 2, "the oval has snapped shut");
  await pressJoint(page, "open", 180, 39);
  await page.click("#hand-left");
  await lay("24224");
  await lay("24188", "24188", "24224");
  assert.equal(await joints("open").count(), 0, "the siding has snapped to the other turnout");
  assert.match(await says(), /No sensor yet/);
  assert.ok(await page.locator("#draft-save").isDisabled());
  for (const [x, y] of [[548, 0], [1097, 720], [548, 78], [188, 720]]) {
    await pressJoint(page, "joined", x, y);
    await page.click("#draft-sensor");
  }
}
