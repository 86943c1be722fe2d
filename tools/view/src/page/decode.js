// Decodes the poses: base64, deflate, differences from the last frame, whole numbers.

function bytesOfBase64(text) {
	const binary = atob(text);
	const bytes = new Uint8Array(binary.length);
	for (let k = 0; k < bytes.length; k++) bytes[k] = binary.charCodeAt(k);
	return bytes;
}

async function inflate(bytes) {
	const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
	return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Whole numbers of a pose: three of the position, three of the quaternion.
const NUMBERS = 6;
// Bytes of a body and frame: two of each number, the largest component of the quaternion, the speed.
const BYTES = 2 * NUMBERS + 2;

// The frames as whole numbers: `numbers[frame][k * bodies + body]`, `largest` and `speed` likewise.
class Recording {
	constructor(head, raw) {
		this.head = head;
		this.bodies = head.bodies;
		this.times = head.times;
		const expected = this.bodies * (1 + BYTES * this.times.length);
		if (raw.length !== expected) throw new Error(`it has ${raw.length} bytes of poses in place of ${expected}`);
		this.kinds = raw.subarray(0, this.bodies);
		this.numbers = [];
		this.largest = [];
		this.speed = [];
		let at = this.bodies;
		const plane = () => raw.subarray(at, (at += this.bodies));
		let last = { numbers: new Uint16Array(NUMBERS * this.bodies), largest: new Uint8Array(this.bodies), speed: new Uint8Array(this.bodies) };
		for (let frame = 0; frame < this.times.length; frame++) {
			const numbers = new Uint16Array(last.numbers.length);
			for (let k = 0; k < NUMBERS; k++) {
				const low = plane();
				const high = plane();
				const begin = k * this.bodies;
				for (let body = 0; body < this.bodies; body++) {
					const coded = low[body] | high[body] << 8;
					numbers[begin + body] = last.numbers[begin + body] + (coded >> 1 ^ -(coded & 1));
				}
			}
			const added = before => {
				const change = plane();
				return before.map((value, body) => value + change[body]);
			};
			last = { numbers, largest: added(last.largest), speed: added(last.speed) };
			this.numbers.push(last.numbers);
			this.largest.push(last.largest);
			this.speed.push(last.speed);
		}
		this.rest = this.agesOfRest();
	}

	// For each frame and body, the share of `restMost` that the body has been at rest, of 255.
	agesOfRest() {
		const most = this.restMost();
		let age = new Float32Array(this.bodies);
		return this.speed.map((speed, frame) => {
			const passed = frame === 0 ? 0 : this.times[frame] - this.times[frame - 1];
			age = age.map((value, body) => speed[body] === 0 ? value + passed : 0);
			return Uint8Array.from(age, value => Math.min(255, 255 * value / most));
		});
	}

	// An age that has the last colour, s.
	restMost() {
		return Math.max(this.times[this.times.length - 1] / 2, 1e-6);
	}

	// Writes the poses of a frame as seven floats a body: x, y, z, and the quaternion.
	poses(frame, into) {
		const { low, quantum, componentMost } = this.head;
		const numbers = this.numbers[frame];
		const largest = this.largest[frame];
		const n = this.bodies;
		const scale = Math.SQRT2 / componentMost;
		for (let body = 0, at = 0; body < n; body++, at += 7) {
			into[at] = low[0] + quantum * numbers[body];
			into[at + 1] = low[1] + quantum * numbers[n + body];
			into[at + 2] = low[2] + quantum * numbers[2 * n + body];
			const a = scale * numbers[3 * n + body] - Math.SQRT1_2;
			const b = scale * numbers[4 * n + body] - Math.SQRT1_2;
			const c = scale * numbers[5 * n + body] - Math.SQRT1_2;
			const rest = 1 - (a * a + b * b + c * c);
			const d = rest > 0 ? Math.sqrt(rest) : 0;
			const most = largest[body];
			into[at + 3] = most === 0 ? d : a;
			into[at + 4] = most === 1 ? d : most === 0 ? a : b;
			into[at + 5] = most === 2 ? d : most === 3 ? c : b;
			into[at + 6] = most === 3 ? d : c;
		}
	}
}
