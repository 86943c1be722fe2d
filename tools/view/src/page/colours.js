// Colours of the bodies, and of light and dark pages.

const THEMES = {
	light: { back: [0.957, 0.961, 0.969], ground: [0.84, 0.85, 0.87] },
	dark: { back: [0.078, 0.09, 0.11], ground: [0.2, 0.22, 0.25] },
};

// Stops from the first to the last value.
const STOPS = {
	speed: [[72, 104, 196], [64, 166, 196], [126, 204, 140], [240, 210, 90], [236, 122, 58], [196, 40, 60]],
	rest: [[240, 168, 70], [198, 178, 130], [130, 164, 168], [78, 120, 170]],
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

// What the colours stand for: a colour a body, and the words of the legend.
class Colouring {
	constructor(recording) {
		this.recording = recording;
		this.colours = new Float32Array(recording.bodies);
		const heights = recording.numbers[0].subarray(recording.bodies, 2 * recording.bodies);
		const most = heights.reduce((a, b) => Math.max(a, b), 1);
		this.start = Uint8Array.from(heights, height => 255 * height / most);
	}

	// The colours at a moment between two frames: red + 256 green + 65536 blue.
	at(name, { frame, next, fraction }) {
		const table = this.recording[name];
		const [before, after] = name === "start" ? [this.start, this.start] : [table[frame], table[next]];
		const packed = this.packed(name);
		const rest = 1 - fraction;
		for (let body = 0; body < this.colours.length; body++) {
			this.colours[body] = packed[rest * before[body] + fraction * after[body] + 0.5 | 0];
		}
		return this.colours;
	}

	packed(name) {
		if (this.packedName !== name) {
			const colours = ramp(name);
			const one = (_, k) => colours[4 * k] + 256 * colours[4 * k + 1] + 65536 * colours[4 * k + 2];
			this.packedRamp = Float32Array.from({ length: 256 }, one);
			this.packedName = name;
		}
		return this.packedRamp;
	}

	legend(name) {
		const { speedMost } = this.recording.head;
		return {
			speed: ["Speed (the scale is a root)", "0 m/s", `${speedMost.toFixed(1)} m/s`],
			rest: ["Age of rest", "moves", `${this.recording.restMost().toFixed(1)} s and more`],
			start: ["Height at the start", "lowest", "highest"],
		}[name];
	}
}
