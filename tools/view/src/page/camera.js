// A camera that turns about a point: angles, distance, and the matrix for the shaders.

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, factor) => a.map(value => value * factor);
const sum = (a, b) => a.map((value, k) => value + b[k]);
const unit = a => scaled(a, 1 / Math.hypot(...a));

const LIGHT = [-0.36, 0.8, 0.48]; // Where it comes from.
const FIELD = 0.7; // Height of the picture, radians.

class Camera {
	// Looks at a box from a side and above.
	constructor(low, high) {
		this.first = { low, high };
		this.reset();
	}

	reset() {
		const { low, high } = this.first;
		this.target = low.map((value, k) => (value + high[k]) / 2);
		this.radius = Math.max(Math.hypot(...high.map((value, k) => value - low[k])) / 2, 1);
		this.distance = 1.12 * this.radius / Math.sin(FIELD / 2);
		this.around = 0.65;
		this.above = 0.4;
	}

	turn(around, above) {
		this.around += around;
		this.above = Math.min(Math.max(this.above + above, -0.1), Math.PI / 2 - 0.01);
	}

	zoom(factor) {
		this.distance = Math.min(Math.max(this.distance * factor, 0.05 * this.radius), 20 * this.radius);
	}

	// Moves the point it looks at; the shares are of the picture's height.
	move(right, up) {
		const { side, upwards } = this.axes();
		const height = 2 * this.distance * Math.tan(FIELD / 2);
		this.target = sum(this.target, sum(scaled(side, -right * height), scaled(upwards, up * height)));
	}

	axes() {
		const flat = Math.cos(this.above);
		const back = [flat * Math.sin(this.around), Math.sin(this.above), flat * Math.cos(this.around)];
		const side = unit(cross([0, 1, 0], back));
		return { back, side, upwards: cross(back, side) };
	}

	eye() {
		return sum(this.target, scaled(this.axes().back, this.distance));
	}

	// The matrix from the world to the picture, column by column.
	matrix(aspect) {
		const { back, side, upwards } = this.axes();
		const eye = this.eye();
		const [near, far] = [this.distance * 0.01, this.distance + 40 * this.radius];
		const scale = 1 / Math.tan(FIELD / 2);
		const rows = [
			[...scaled(side, scale / aspect), -dot(side, eye) * scale / aspect],
			[...scaled(upwards, scale), -dot(upwards, eye) * scale],
			[...scaled(back, (far + near) / (near - far)), (-dot(back, eye) * (far + near) + 2 * far * near) / (near - far)],
			[...scaled(back, -1), dot(back, eye)],
		];
		return Float32Array.from({ length: 16 }, (_, k) => rows[k % 4][k >> 2]);
	}
}
