"use strict";
// The pages that the test opens, and what each of them must do. A check gets the opened page, and throws
// where the page is wrong. To test another page, add an entry.

const assert = require("node:assert/strict");

// The pixels of the picture, 64 by 36 of them, as one text.
async function pixels(page) {
	return page.evaluate(() => {
		const { player } = window;
		player.draw();
		const small = Object.assign(document.createElement("canvas"), { width: 64, height: 36 });
		const pen = small.getContext("2d");
		pen.drawImage(player.canvas, 0, 0, 64, 36);
		return Array.from(pen.getImageData(0, 0, 64, 36).data).join(" ");
	});
}

const colours = text => new Set(text.match(/\d+ \d+ \d+ 255/g)).size;

async function at(page, time) {
	await page.evaluate(time => {
		const scrub = document.getElementById("scrub");
		scrub.value = time * scrub.max;
		scrub.dispatchEvent(new Event("input"));
	}, time);
	return pixels(page);
}

// The page of `pgs run --view`.
async function view(page, { measure, screenshot }) {
	await page.waitForFunction(() => window.player, null, { timeout: 60000 });
	const playing = await page.textContent("#play");
	assert.equal(playing, "Pause", "it plays by itself");
	await measure("while it plays");

	const [start, end] = [await at(page, 0), await at(page, 1)];
	assert.ok(colours(start) > 10, `the picture is uniform: ${colours(start)} colours`);
	assert.notEqual(start, end, "the scrub bar changes the picture");
	assert.equal(await page.textContent("#play"), "Play", "the scrub bar stops the playing");

	const seen = new Set();
	await at(page, 0.6);
	for (const colour of ["speed", "rest", "start"]) {
		await page.selectOption("#colour", colour);
		seen.add(await pixels(page));
	}
	assert.equal(seen.size, 3, "each colouring is another picture");
	await page.focus("#picture");
	await page.keyboard.press("c");
	assert.equal(await page.inputValue("#colour"), "speed", "the key C goes on to the first colouring");

	const before = await pixels(page);
	await page.keyboard.press("ArrowLeft");
	const turned = await pixels(page);
	assert.notEqual(before, turned, "an arrow key turns the view");
	const box = await page.locator("#picture").boundingBox();
	await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
	await page.mouse.down();
	await page.mouse.move(box.x + box.width / 2 + 120, box.y + box.height / 2 + 30, { steps: 4 });
	await page.mouse.up();
	const dragged = await pixels(page);
	assert.notEqual(turned, dragged, "the mouse turns the view");
	await page.mouse.wheel(0, 300);
	await page.waitForTimeout(100);
	assert.notEqual(dragged, await pixels(page), "the wheel zooms");
	await page.keyboard.press("0");
	assert.equal(before, await pixels(page), "the key 0 brings the first view back");

	await page.keyboard.press("t");
	assert.notEqual(before, await pixels(page), "the key T changes between light and dark");
	await page.keyboard.press("t");
	const [download] = await Promise.all([page.waitForEvent("download"), page.click("#screenshot")]);
	assert.match(download.suggestedFilename(), /^zynq-pgs-.*\.png$/);
	await at(page, 1);
	await screenshot();
}

module.exports = { view };
