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

	const kinds = await page.evaluate(() => window.player.recording.head.kinds.length);
	assert.equal(await page.inputValue("#colour"), kinds > 1 ? "kind" : "speed", "several kinds have their colours");
	const facts = await page.textContent("dl");
	for (const fact of ["profile", "passes of a step", "ms a step on the board (modelled)"]) {
		assert.ok(facts.includes(fact), `the page tells ${fact}: ${facts}`);
	}
	const shadowed = await pixels(page);
	await page.evaluate(() => { window.player.painter.drawShadows = () => {}; });
	const plain = await pixels(page);
	await page.evaluate(() => { delete window.player.painter.drawShadows; });
	assert.notEqual(shadowed, plain, "bodies have shadows on the ground");

	const seen = new Set();
	await at(page, 0.6);
	for (const colour of ["kind", "speed", "start"]) {
		await page.selectOption("#colour", colour);
		seen.add(await pixels(page));
	}
	assert.equal(seen.size, 3, "each colouring is another picture");
	await page.focus("#picture");
	await page.keyboard.press("c");
	assert.equal(await page.inputValue("#colour"), "kind", "the key C goes on to the first colouring");
	assert.equal(await page.isVisible("#legend-scale"), false, "kinds have no scale");
	assert.ok(await page.locator("#legend-kinds span").count() > 0, "the legend names each kind");

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
	const distance = await page.evaluate(() => window.player.camera.distance);
	await page.mouse.wheel(0, 300);
	await page.waitForFunction(before => window.player.camera.distance !== before, distance, { timeout: 10000 });
	assert.notEqual(dragged, await pixels(page), "the wheel zooms");
	await page.keyboard.press("0");
	assert.equal(before, await pixels(page), "the key 0 brings the first view back");

	await page.evaluate(() => window.player.setTime(window.player.end));
	const time = () => page.evaluate(() => window.player.time);
	const times = await page.evaluate(() => Array.from(window.player.recording.times));
	for (const [key, back] of [[",", 2], [",", 3], [".", 2], [".", 1]]) {
		await page.keyboard.press(key);
		assert.equal(await time(), times[times.length - back], `the key ${key} goes to the frame beside`);
	}
	await page.evaluate(() => window.player.setTime((window.player.recording.times[1] + window.player.recording.times[2]) / 2));
	await page.keyboard.press(",");
	assert.equal(await time(), times[1], "between two frames the key , goes to the one before");
	await at(page, 0.6);

	await page.keyboard.press("t");
	assert.notEqual(before, await pixels(page), "the key T changes between light and dark");
	await page.keyboard.press("t");
	const [download] = await Promise.all([page.waitForEvent("download"), page.click("#screenshot")]);
	assert.match(download.suggestedFilename(), /^zynq-pgs-.*\.png$/);
	await at(page, 1);
	await screenshot();
}

// The page of `pgs run --live`, opened while the run goes on.
async function live(page, { screenshot }) {
	await page.waitForFunction(() => window.player, null, { timeout: 60000 });
	const last = () => page.evaluate(() => [window.player.live, window.player.end]);
	const [isLive, before] = await last();
	assert.ok(isLive, "the run goes on");
	for (let frames = 0, time = before; frames < 20; frames++) {
		await page.waitForFunction(time => window.player.end > time, time, { timeout: 30000 });
		time = (await last())[1];
	}
	assert.match(await page.textContent("#state"), /^Live: step [0-9]+, [0-9.]+ ms a step on the board \(modelled\)$/);
	await page.waitForFunction(() => window.player.time === window.player.end, null, { timeout: 30000 });
	assert.ok(colours(await pixels(page)) > 10, "the picture is not uniform");
	await screenshot();
	await page.focus("#picture");
	await page.keyboard.press(",");
	const stopped = await page.evaluate(() => window.player.time);
	await page.waitForFunction(time => window.player.end > time + 0.2, stopped, { timeout: 30000 });
	assert.equal(await page.evaluate(() => window.player.time), stopped, "an earlier frame stays in view");
	await page.keyboard.press(" ");
	await page.waitForFunction(time => window.player.time > time, stopped, { timeout: 30000 });
	assert.ok((await last())[0], "the run still goes on");
}

// The figures of the thesis that the report draws, and the recorded numbers that it sets beside ours.
const FIGURES = [
	"2-2", "2-6", "4-1", "4-2", "4-5", "4-6", "4-7", "4-8", "4-9", "4-10", "4-13", "5-1", "5-2", "6-1", "6-2",
];
const RECORDED = ["2.97 %", "84.29 %", "99.93 %", "0.02 %", "99.64 %", "0.06 %", "1,528"];

// The page of `pgs thesis --all`.
async function report(page, { screenshot }) {
	const found = await page.evaluate(() => ({
		figures: Array.from(document.querySelectorAll("figure"), figure => {
			const svg = figure.querySelector("svg");
			const { width, height } = svg.getBoundingClientRect();
			const drawn = svg.querySelectorAll("polyline, path, rect, circle, polygon").length;
			// A picture of the scene lies in the page as one image.
			const pictured = svg.querySelector("image[href^='data:image/png']")?.getAttribute("href").length ?? 0;
			return { id: figure.id, width, height, drawn, pictured, caption: figure.querySelector("figcaption").textContent };
		}),
		rows: Array.from(document.querySelectorAll("table.index tbody tr"), row =>
			Array.from(row.cells, cell => cell.textContent.trim())),
		lost: Array.from(document.querySelectorAll("a[href^='#']"), link => link.hash.slice(1))
			.filter(id => !document.getElementById(id)),
	}));
	for (const { id, width, height, drawn, pictured, caption } of found.figures) {
		const size = `${width} x ${height}, ${drawn} shapes, an image of ${pictured} characters`;
		assert.ok(width > 300 && height > 100 && (drawn > 3 || pictured > 10_000), `${id} is drawn: ${size}`);
		assert.ok(caption.length > 10, `${id} has a caption`);
	}
	const ids = found.figures.map(figure => figure.id);
	for (const number of FIGURES) assert.ok(ids.includes(`figure-${number}`), `figure ${number} is there`);
	assert.deepEqual(found.lost, [], "every link of the index leads to a figure or a table");
	assert.ok(found.rows.length > 40, `the index has ${found.rows.length} rows`);
	for (const cells of found.rows) {
		assert.equal(cells.length, 6, "thesis, subject, its figure, ours, origin, command");
		for (const cell of cells) assert.notEqual(cell, "", `a row of the index has no empty cell: ${cells.join(" | ")}`);
	}
	for (const number of RECORDED) {
		const row = found.rows.find(cells => cells[2].includes(number));
		assert.ok(row, `the recorded ${number} is in the index`);
		assert.match(row[3], /[0-9]/, `ours stands beside ${number}`);
	}
	const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
	const grounds = new Set();
	for (const colorScheme of ["light", "dark"]) {
		await page.emulateMedia({ colorScheme });
		grounds.add(await ground());
	}
	assert.equal(grounds.size, 2, "light and dark differ");
	await page.emulateMedia({ colorScheme: "light" });
	await screenshot();
	await page.locator("#figure-4-2").scrollIntoViewIfNeeded();
	await screenshot("figures");

	await page.locator("details summary").first().click();
	await page.locator("iframe").first().scrollIntoViewIfNeeded();
	const player = await (await page.locator("iframe").first().elementHandle()).contentFrame();
	await player.waitForFunction(() => window.player && window.player.pictures > 2, null, { timeout: 60000 });
}

module.exports = { live, report, view };
