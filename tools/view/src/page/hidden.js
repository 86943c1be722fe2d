// Leaves out bodies that others hide: a software renderer takes long for triangles that are not seen.
//
// The picture is divided into cells. From near to far, a body whose cells are all covered is left out; any
// other one covers the cells that lie within a disc about its centre, where the body has no gap.

const CELLS_OF_DISC = 2.5; // Radius of the middle body's disc, in cells.
const CELLS_MOST = 1 << 18;

class Cover {
	// Each kind of body has two radii: of the disc that the body covers, and of the ball around the body.
	constructor(kinds, covering, around) {
		this.kinds = kinds;
		this.covering = covering;
		this.around = around;
		this.cells = new Uint8Array(CELLS_MOST);
	}

	// Begins a picture: the matrix of the camera, and the distance of the middle of the scene.
	begin(matrix, aspect, distance) {
		this.matrix = matrix;
		// Half the height of the picture is 1 at a distance of matrix' scale.
		this.scale = 1 / Math.tan(FIELD / 2);
		const disc = this.scale * Math.max(...this.covering) / distance;
		const most = Math.floor(Math.sqrt(CELLS_MOST / aspect));
		this.height = Math.max(Math.min(Math.ceil(2 * CELLS_OF_DISC / disc), most), 1);
		this.width = Math.max(Math.floor(this.height * aspect), 1);
		this.cells.fill(0, 0, this.width * this.height);
	}

	// Returns whether a body at this place may be seen. A visible body covers the bodies behind it.
	isSeen(body, x, y, z) {
		const { matrix: m, width, height, cells } = this;
		const kind = this.kinds[body];
		const around = this.around[kind];
		const w = m[3] * x + m[7] * y + m[11] * z + m[15];
		if (w < around) return w > -around;
		const unit = 0.5 * height * this.scale / w; // Cells of a metre there.
		const cx = (0.5 + 0.5 * (m[0] * x + m[4] * y + m[8] * z + m[12]) / w) * width;
		const cy = (0.5 + 0.5 * (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * height;
		const reach = around * unit;
		const left = Math.max(Math.floor(cx - reach), 0);
		const right = Math.min(Math.floor(cx + reach), width - 1);
		const low = Math.max(Math.floor(cy - reach), 0);
		const high = Math.min(Math.floor(cy + reach), height - 1);
		let seen = false;
		for (let j = low; j <= high && !seen; j++) {
			const row = j * width;
			for (let i = left; i <= right; i++) {
				if (cells[row + i] === 0) {
					seen = true;
					break;
				}
			}
		}
		if (!seen) return false;
		const disc = this.covering[kind] * unit;
		const bottom = Math.max(Math.ceil(cy - disc), 0);
		const top = Math.min(Math.floor(cy + disc), height) - 1;
		for (let j = bottom; j <= top; j++) {
			const far = Math.abs(j + 0.5 - cy) + 0.5;
			const half = Math.sqrt(Math.max(disc * disc - far * far, 0));
			const first = Math.max(Math.ceil(cx - half), 0);
			const last = Math.min(Math.floor(cx + half), width);
			if (last > first) cells.fill(1, j * width + first, j * width + last);
		}
		return true;
	}
}
