"use strict";
// Opens pages in a headless browser and checks them; browser-test.sh says how it is called.

const fs = require("node:fs");
const os = require("node:os");
const path = require("node:path");
const { pathToFileURL } = require("node:url");
const { chromium } = require("playwright-core");
const checks = require("./pages.js");

const SECONDS = 5; // Length of a measurement of frames a second.

const FLAGS = [
	"--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
	"--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
];

// Opens a page, and has it checked; returns the errors.
async function test(context, kind, file, folder) {
	const page = await context.newPage();
	const errors = [];
	page.on("console", message => {
		if (message.type() === "error") errors.push(`on the console: ${message.text()}`);
	});
	page.on("pageerror", error => errors.push(`not caught: ${error.message}`));
	page.on("request", request => {
		const own = kind === "live" && request.url().startsWith(file);
		if (/^(https?|wss?):/.test(request.url()) && !own) errors.push(`asks the network for ${request.url()}`);
	});
	const name = kind === "live" ? "live" : path.basename(file);
	const tools = {
		// Pictures a second that the page's `player` draws by itself.
		async measure(what) {
			const pictures = () => page.evaluate(() => [window.player.pictures, performance.now()]);
			const begin = await pictures();
			await page.waitForTimeout(1000 * SECONDS);
			const end = await pictures();
			const { width, height, row } = await page.evaluate(() => ({
				width: window.player.canvas.width, height: window.player.canvas.height, row: window.player.resolution,
			}));
			const rate = 1000 * (end[0] - begin[0]) / (end[1] - begin[1]);
			console.log(`${name}: ${rate.toFixed(1)} frames a second ${what}, ${width} x ${height} pixels (${Math.round(100 * row)} % of the rows)`);
			return rate;
		},
		async screenshot(part) {
			const stem = [path.parse(name).name, part].filter(Boolean).join("-");
			const picture = path.join(folder, `${stem}.png`);
			await page.screenshot({ path: picture });
			console.log(`${name}: screenshot ${picture}`);
		},
	};
	try {
		const url = kind === "live" ? file : pathToFileURL(path.resolve(file)).href;
		await page.goto(url, { timeout: 120000 });
		await checks[kind](page, tools);
	} catch (error) {
		errors.push(error.message);
	}
	await page.close();
	return errors;
}

async function main() {
	const [browser, folder, ...pages] = process.argv.slice(2);
	const profile = fs.mkdtempSync(path.join(os.tmpdir(), "browser-test."));
	let failed = 0;
	try {
		const context = await chromium.launchPersistentContext(profile, {
			executablePath: browser, headless: true, args: FLAGS, viewport: { width: 1280, height: 720 },
		});
		for (const entry of pages) {
			const [kind, file] = entry.split(/=(.*)/);
			const errors = await test(context, kind, file, folder);
			const name = kind === "live" ? "live" : path.basename(file);
			for (const error of errors) console.error(`${name}: ${error}`);
			console.log(`${name}: ${errors.length === 0 ? "passed" : "failed"}`);
			failed += errors.length;
		}
		await context.close();
	} finally {
		fs.rmSync(profile, { recursive: true, force: true });
	}
	process.exitCode = failed > 0 ? 1 : 0;
}

main();
