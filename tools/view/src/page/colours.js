// Colours of the bodies, and of light and dark pages.

const THEMES = {
	light: { back: [0.957, 0.961, 0.969], ground: [0.84, 0.85, 0.87] },
	dark: { back: [0.078, 0.09, 0.11], ground: [0.2, 0.22, 0.25] },
};

// Stops from the first to the last value.
const STOPS = {
	speed: [[72, 104, 196], [64, 166, 196], [126, 204, 140], [240, 210, 90], [236, 122, 58], [196, 40, 60]],
	start: [[88, 76, 150], [60, 130, 160], [90, 180, 130], [230, 208, 90]],
};

// 256 colours of four bytes.
function ramp(name) {
	const stops = STOPS[name];
	const colours = new Uint8Array(4 * 256);
	for (let k = 0; k < 256; k++) {
		const place = k / 255 * (stops.length - 1);
		const index = Math.min(Math.floor(place), stops.length - 2);
		const share = place - index;
		for (let c = 0; c < 3; c++) colours[4 * k + c] = (1 - share) * stops[index][c] + share * stops[index + 1][c];
		colours[4 * k + 3] = 255;
	}
	return colours;
}

const packed = ([red, green, blue]) => red + 256 * green + 65536 * blue;

// What the colours stand for: a colour a body, and the words of the legend.
class Colouring {
	constructor(recording) {
		this.recording = recording;
		this.colours = new Float32Array(recording.bodies);
		const { bodies, kinds } = recording;
		const { numbers, low, quantum } = recording.frames[0];
		const heights = Float32Array.from({ length: bodies }, (_, body) => low[1] + quantum * numbers[bodies + body]);
		const [least, most] = [Math.min, Math.max].map(end => heights.reduce((a, b) => end(a, b), heights[0]));
		this.start = heights.map(height => 255 * (height - least) / Math.max(most - least, 1e-6));
		this.kind = Float32Array.from(kinds, kind => packed(recording.head.kinds[kind].colour));
		this.ramps = Object.fromEntries(Object.keys(STOPS).map(name => {
			const colours = ramp(name);
			return [name, Float32Array.from({ length: 256 }, (_, k) => packed(colours.subarray(4 * k, 4 * k + 3)))];
		}));
	}

	// The colours at a moment between two frames: red + 256 green + 65536 blue.
	at(name, { frame, next, fraction }) {
		if (name === "kind") return this.kind;
		const { frames, speedMost } = this.recording;
		const [before, after] = [frames[frame].speed, frames[next].speed];
		const rest = 1 - fraction;
		for (let body = 0; body < this.colours.length; body++) {
			// The root shows slow bodies, too.
			const value = name === "start" ? this.start[body]
				: 255 * Math.sqrt((rest * before[body] + fraction * after[body]) / speedMost);
			this.colours[body] = this.ramps[name][value + 0.5 | 0];
		}
		return this.colours;
	}

	legend(name) {
		return {
			kind: ["Kind"],
			speed: ["Speed", "0 m/s", `${this.recording.speedMost.toFixed(1)} m/s`],
			start: ["Height at the start", "lowest", "highest"],
		}[name];
	}
}
