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
// Bytes of a body and frame: two of each number, the largest component of the quaternion.
const BYTES = 2 * NUMBERS + 1;
// A body that is slower is at rest, m/s.
const SLOWEST = 0.05;
// Most bytes of all frames of a run that plays while it steps; the oldest frames go.
const BYTES_MOST = 256 << 20;

// The frames as whole numbers: `numbers[k * bodies + body]` of a frame, `largest` and `speed` likewise.
class Recording {
	constructor(head) {
		this.head = head;
		this.kinds = Uint8Array.from(head.of);
		this.bodies = this.kinds.length;
		this.times = [];
		this.frames = [];
		this.speedMost = SLOWEST;
	}

	// Adds the frames of a page.
	read(raw) {
		const { times, low, quantum } = this.head;
		const expected = this.bodies * BYTES * times.length;
		if (raw.length !== expected) throw new Error(`it has ${raw.length} bytes of poses in place of ${expected}`);
		let at = 0;
		const plane = () => raw.subarray(at, (at += this.bodies));
		let last = { numbers: new Uint16Array(NUMBERS * this.bodies), largest: new Uint8Array(this.bodies) };
		for (const time of times) {
			const numbers = new Uint16Array(last.numbers.length);
			for (let k = 0; k < NUMBERS; k++) {
				const below = plane();
				const above = plane();
				const begin = k * this.bodies;
				for (let body = 0; body < this.bodies; body++) {
					const coded = below[body] | above[body] << 8;
					numbers[begin + body] = last.numbers[begin + body] + (coded >> 1 ^ -(coded & 1));
				}
			}
			const change = plane();
			last = { numbers, largest: last.largest.map((value, body) => value + change[body]) };
			this.add(time, { ...last, low, quantum });
		}
	}

	// Adds a frame that was sent alone.
	receive({ time, low, quantum, poses }) {
		const bytes = bytesOfBase64(poses);
		const words = NUMBERS * this.bodies;
		this.add(time, { numbers: new Uint16Array(bytes.buffer, 0, words), largest: bytes.subarray(2 * words), low, quantum });
		if (this.frames.length * this.bodies * (BYTES + 4) > BYTES_MOST) {
			this.times.shift();
			this.frames.shift();
		}
	}

	add(time, frame) {
		frame.speed = this.speeds(frame, this.frames.at(-1), time - this.times.at(-1));
		this.times.push(time);
		this.frames.push(frame);
	}

	// The speed of each body since the frame before, m/s; 0 if rounding alone may have moved it.
	speeds(now, before, passed) {
		const speeds = new Float32Array(this.bodies);
		if (!before || !(passed > 0)) return speeds;
		const n = this.bodies;
		const least = Math.max(SLOWEST * passed, 1.5 * now.quantum);
		const along = (axis, body) => now.low[axis] - before.low[axis] +
			now.quantum * now.numbers[axis * n + body] - before.quantum * before.numbers[axis * n + body];
		for (let body = 0; body < n; body++) {
			const distance = Math.hypot(along(0, body), along(1, body), along(2, body));
			if (distance < least) continue;
			speeds[body] = distance / passed;
			this.speedMost = Math.max(this.speedMost, speeds[body]);
		}
		return speeds;
	}

	// Writes the poses of a frame as seven floats a body: x, y, z, and the quaternion.
	poses({ numbers, largest, low, quantum }, into) {
		const n = this.bodies;
		const scale = Math.SQRT2 / this.head.componentMost;
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
