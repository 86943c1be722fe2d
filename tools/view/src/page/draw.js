// Draws the bodies with WebGL2, many in one call and without instances: a software renderer draws each
// instance by itself. The vertex shader takes the body from the vertex's number and its pose from a texture.
//
// Of a box only the corner that is nearest to the eye and its three faces are drawn: seven corners
// and six triangles. Each triangle takes the shade of its last corner, and both triangles of a face
// have one last corner.

// Bodies in a row of the texture: 2 to the power of this.
const ROW_BITS = 9;
const ROW = 1 << ROW_BITS;

const VERTEX_BEGIN = `#version 300 es
precision highp float;
uniform highp sampler2D bodies;
uniform int firstBody;
uniform mat4 matrix;
uniform bool shadow;
const vec3 LIGHT = vec3(${LIGHT.join(", ")});
struct Body { vec3 position; vec4 rotation; vec3 colour; };
Body bodyOf(int index) {
	index += firstBody;
	ivec2 at = ivec2(2 * (index & ${ROW - 1}), index >> ${ROW_BITS});
	vec4 place = texelFetch(bodies, at, 0);
	int colour = int(place.w);
	vec3 parts = vec3(colour & 255, colour >> 8 & 255, colour >> 16) / 255.0;
	return Body(place.xyz, texelFetch(bodies, at + ivec2(1, 0), 0), parts);
}
vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
float shade(vec3 normal) { return 0.62 + 0.38 * dot(normal, LIGHT); }
// Where a point is drawn: the point itself, or its shadow on the ground.
vec4 drawn(vec3 point) {
	if (shadow) point -= max(point.y, 0.0) / LIGHT.y * LIGHT;
	return matrix * vec4(point.x, shadow ? 0.0 : point.y, point.z, 1.0);
}
`;

// The corners of a box seen from a corner: 4, 5 and 6 are the last ones of the faces x, y and z.
const BOX_CORNERS = 7;
const BOX_TRIANGLES = [[0, 1, 4], [2, 0, 4], [1, 0, 5], [0, 3, 5], [0, 2, 6], [3, 0, 6]].flat();

const BOX_VERTEX = `${VERTEX_BEGIN}
uniform vec3 eye;
uniform vec3 size;
flat out vec3 colour;
out vec3 local;
const vec3 CORNERS[${BOX_CORNERS}] = vec3[${BOX_CORNERS}](vec3(1), vec3(1, 1, -1), vec3(1, -1, 1), vec3(-1, 1, 1),
	vec3(1, -1, -1), vec3(-1, 1, -1), vec3(-1, -1, 1));
void main() {
	int index = gl_VertexID / ${BOX_CORNERS};
	int corner = gl_VertexID - ${BOX_CORNERS} * index;
	Body body = bodyOf(index);
	vec4 back = vec4(-body.rotation.xyz, body.rotation.w);
	vec3 towards = shadow ? LIGHT : eye - body.position;
	vec3 side = mix(vec3(1), vec3(-1), lessThan(turned(back, towards), vec3(0)));
	vec3 axis = vec3(corner == 4, corner == 5, corner == 6);
	colour = body.colour * shade(turned(body.rotation, side * axis));
	local = CORNERS[corner];
	gl_Position = drawn(body.position + turned(body.rotation, local * side * size));
}`;

const BOX_FRAGMENT = `#version 300 es
precision mediump float;
flat in vec3 colour;
in vec3 local;
out vec4 result;
void main() {
	vec3 a = abs(local);
	float second = max(min(a.x, a.y), min(max(a.x, a.y), a.z));
	result = vec4(second > 0.93 ? colour * 0.72 : colour, 1.0);
}`;

const MESH_VERTEX = `${VERTEX_BEGIN}
uniform highp sampler2D surface;
uniform int corners;
out vec3 colour;
void main() {
	int index = gl_VertexID / corners;
	int corner = gl_VertexID - corners * index;
	Body body = bodyOf(index);
	vec3 normal = texelFetch(surface, ivec2(corner, 1), 0).xyz;
	colour = body.colour * shade(turned(body.rotation, normal));
	vec3 place = texelFetch(surface, ivec2(corner, 0), 0).xyz;
	gl_Position = drawn(body.position + turned(body.rotation, place));
}`;

const MESH_FRAGMENT = `#version 300 es
precision mediump float;
in vec3 colour;
out vec4 result;
void main() { result = vec4(colour, 1.0); }`;

const GROUND_VERTEX = `#version 300 es
uniform mat4 matrix;
uniform vec3 middle;
uniform float reach;
out vec2 place;
out vec2 share;
void main() {
	share = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
	place = middle.xz + reach * share;
	gl_Position = matrix * vec4(place.x, 0.0, place.y, 1.0);
}`;

const GROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 ground;
uniform vec3 back;
uniform float spacing;
in vec2 place;
in vec2 share;
out vec4 result;
void main() {
	vec2 at = place / spacing;
	vec2 width = fwidth(at);
	vec2 line = clamp(1.5 - abs(fract(at - 0.5) - 0.5) / width, 0.0, 1.0) * clamp(0.7 - width, 0.0, 0.45);
	vec3 colour = ground * (1.0 - 0.5 * max(line.x, line.y));
	result = vec4(mix(colour, back, smoothstep(0.3, 1.0, length(share))), 1.0);
}`;

// Floats of a body in the texture: position and colour, quaternion.
const FLOATS = 8;
// From this number of bodies on, only bodies whose centre is not higher than some radii cast a shadow: a
// software renderer takes as long for the shadows of all as for the bodies.
const MANY = 4096;
const CONTACT = 2.5;
// The brightness that a shadow leaves.
const SHADOW = 0.66;
// Steps of the depth by which bodies are sorted.
const BINS = 1024;
// Most corners in one call.
const CORNERS_MOST = 1 << 20;

class Painter {
	constructor(canvas, head, kinds) {
		this.canvas = canvas;
		this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false, stencil: true });
		if (!this.gl) throw new Error("this browser has no WebGL2");
		const gl = this.gl;
		this.kinds = kinds;
		this.rows = Math.max(Math.ceil(kinds.length / ROW), 1);
		this.placed = new Float32Array(FLOATS * ROW * this.rows);
		this.bodies = this.texture(2 * ROW, this.rows, this.placed);
		this.around = head.kinds.map(kind => kind.around);
		this.depths = new Float32Array(kinds.length);
		this.order = new Uint32Array(kinds.length);
		this.ends = new Uint32Array(BINS + 1);
		this.cover = new Cover(kinds, head.kinds.map(kind => kind.covering), head.kinds.map(kind => kind.around));
		this.box = this.program(BOX_VERTEX, BOX_FRAGMENT);
		this.mesh = this.program(MESH_VERTEX, MESH_FRAGMENT);
		this.floor = this.program(GROUND_VERTEX, GROUND_FRAGMENT);
		let begin = 0;
		this.shapes = head.kinds.map((kind, index) => {
			const count = kinds.reduce((sum, other) => sum + (other === index), 0);
			const range = { begin, end: begin };
			begin += count;
			if (kind.box) return { size: kind.box, ...range, ...this.repeated(BOX_TRIANGLES, BOX_CORNERS, count) };
			const corners = kind.positions.length / 3;
			const texels = [kind.positions, kind.normals].map(list => {
				const row = new Float32Array(4 * corners);
				list.forEach((value, k) => row[4 * Math.floor(k / 3) + k % 3] = value);
				return [...row];
			});
			const surface = this.texture(corners, 2, new Float32Array(texels.flat()));
			return { surface, ...range, ...this.repeated(kind.triangles, corners, count) };
		});
		gl.enable(gl.DEPTH_TEST);
	}

	program(vertex, fragment) {
		const gl = this.gl;
		const program = gl.createProgram();
		for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
			const shader = gl.createShader(kind);
			gl.shaderSource(shader, text);
			gl.compileShader(shader);
			gl.attachShader(program, shader);
		}
		gl.linkProgram(program);
		if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
			const logs = gl.getAttachedShaders(program).map(shader => gl.getShaderInfoLog(shader));
			throw new Error(`a shader does not build: ${logs.join(" ")}`);
		}
		const names = ["matrix", "shadow", "bodies", "firstBody", "eye", "size", "surface", "corners", "middle", "reach", "ground", "back", "spacing"];
		return { program, at: Object.fromEntries(names.map(name => [name, gl.getUniformLocation(program, name)])) };
	}

	texture(width, height, texels) {
		const gl = this.gl;
		const texture = gl.createTexture();
		gl.bindTexture(gl.TEXTURE_2D, texture);
		gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
		gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
		gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, texels);
		return texture;
	}

	// The triangles of up to `count` bodies. Each body has `corners` corners.
	repeated(triangles, corners, count) {
		const gl = this.gl;
		const most = Math.max(Math.min(count, Math.floor(CORNERS_MOST / corners)), 1);
		const indices = new Uint32Array(most * triangles.length);
		for (let body = 0, at = 0; body < most; body++) {
			for (const corner of triangles) indices[at++] = body * corners + corner;
		}
		const array = gl.createVertexArray();
		gl.bindVertexArray(array);
		gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
		gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
		gl.bindVertexArray(null);
		return { array, corners, most, each: triangles.length };
	}

	// Places the bodies that may be seen by kind, and from near to far, so that few hidden pixels are drawn.
	place(poses, colours, camera, matrix) {
		const { kinds, depths, order, ends, placed } = this;
		const { back } = camera.axes();
		const n = kinds.length;
		let [nearest, farthest] = [Infinity, -Infinity];
		for (let body = 0, at = 0; body < n; body++, at += 7) {
			depths[body] = -(back[0] * poses[at] + back[1] * poses[at + 1] + back[2] * poses[at + 2]);
			// As the array has rounded it: no depth lies before the nearest one.
			const depth = depths[body];
			if (depth < nearest) nearest = depth;
			if (depth > farthest) farthest = depth;
		}
		const scale = (BINS - 1) / Math.max(farthest - nearest, 1e-6);
		ends.fill(0);
		for (let body = 0; body < n; body++) ends[((depths[body] - nearest) * scale | 0) + 1]++;
		for (let bin = 1; bin < ends.length; bin++) ends[bin] += ends[bin - 1];
		for (let body = 0; body < n; body++) order[ends[(depths[body] - nearest) * scale | 0]++] = body;

		this.cover.begin(matrix, this.canvas.width / this.canvas.height, camera.distance);
		for (const shape of this.shapes) shape.end = shape.begin;
		for (let k = 0; k < n; k++) {
			const body = order[k];
			const at = 7 * body;
			if (!this.cover.isSeen(body, poses[at], poses[at + 1], poses[at + 2])) continue;
			this.put(body, poses, colours[body]);
		}
	}

	// Places the bodies that cast a shadow: all, or of many only the ones near the ground.
	placeShadows(poses) {
		const n = this.kinds.length;
		for (const shape of this.shapes) shape.end = shape.begin;
		for (let body = 0; body < n; body++) {
			const isNear = poses[7 * body + 1] < CONTACT * this.around[this.kinds[body]];
			if (isNear || n < MANY) this.put(body, poses, 0);
		}
	}

	put(body, poses, colour) {
		const { placed } = this;
		const at = 7 * body;
		const to = FLOATS * this.shapes[this.kinds[body]].end++;
		placed[to] = poses[at];
		placed[to + 1] = poses[at + 1];
		placed[to + 2] = poses[at + 2];
		placed[to + 3] = colour;
		placed[to + 4] = poses[at + 3];
		placed[to + 5] = poses[at + 4];
		placed[to + 6] = poses[at + 5];
		placed[to + 7] = poses[at + 6];
	}

	// Draws the poses, seven floats a body, with a colour a body: red + 256 green + 65536 blue.
	draw(poses, colours, camera, theme) {
		const gl = this.gl;
		const matrix = camera.matrix(this.canvas.width / this.canvas.height);
		this.place(poses, colours, camera, matrix);
		this.upload();
		gl.viewport(0, 0, this.canvas.width, this.canvas.height);
		gl.clearColor(...theme.back, 1);
		gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
		for (const shape of this.shapes) this.drawKind(shape, matrix, camera, false);
		this.drawGround(matrix, camera, theme);
		this.drawShadows(poses, matrix, camera);
	}

	// Hands the placed bodies to the shaders.
	upload() {
		const gl = this.gl;
		gl.activeTexture(gl.TEXTURE0);
		gl.bindTexture(gl.TEXTURE_2D, this.bodies);
		gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2 * ROW, this.rows, gl.RGBA, gl.FLOAT, this.placed);
	}

	// Darkens the ground once where one shadow or several lie.
	drawShadows(poses, matrix, camera) {
		const gl = this.gl;
		this.placeShadows(poses);
		this.upload();
		const states = [gl.STENCIL_TEST, gl.BLEND, gl.POLYGON_OFFSET_FILL];
		for (const state of states) gl.enable(state);
		gl.stencilFunc(gl.EQUAL, 0, 1);
		gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
		gl.blendColor(SHADOW, SHADOW, SHADOW, 1);
		gl.blendFunc(gl.ZERO, gl.CONSTANT_COLOR);
		gl.polygonOffset(-1, -2);
		gl.depthMask(false);
		for (const shape of this.shapes) this.drawKind(shape, matrix, camera, true);
		gl.depthMask(true);
		for (const state of states) gl.disable(state);
	}

	drawKind(shape, matrix, camera, shadow) {
		const gl = this.gl;
		const { program, at } = shape.size ? this.box : this.mesh;
		gl.useProgram(program);
		gl.uniformMatrix4fv(at.matrix, false, matrix);
		gl.uniform1i(at.bodies, 0);
		gl.uniform1i(at.shadow, shadow);
		if (shape.size) {
			gl.uniform3fv(at.eye, camera.eye());
			gl.uniform3fv(at.size, shape.size);
			gl.disable(gl.CULL_FACE);
		} else {
			gl.activeTexture(gl.TEXTURE1);
			gl.bindTexture(gl.TEXTURE_2D, shape.surface);
			gl.uniform1i(at.surface, 1);
			gl.uniform1i(at.corners, shape.corners);
			gl.enable(gl.CULL_FACE);
		}
		gl.bindVertexArray(shape.array);
		for (let first = shape.begin; first < shape.end; first += shape.most) {
			gl.uniform1i(at.firstBody, first);
			const count = Math.min(shape.most, shape.end - first);
			gl.drawElements(gl.TRIANGLES, count * shape.each, gl.UNSIGNED_INT, 0);
		}
	}

	drawGround(matrix, camera, theme) {
		const gl = this.gl;
		const { program, at } = this.floor;
		gl.disable(gl.CULL_FACE);
		gl.useProgram(program);
		gl.uniformMatrix4fv(at.matrix, false, matrix);
		gl.uniform3fv(at.middle, camera.target);
		gl.uniform1f(at.reach, 6 * camera.radius);
		gl.uniform1f(at.spacing, 10 ** Math.max(Math.round(Math.log10(camera.radius / 2)), 0));
		gl.uniform3fv(at.ground, theme.ground);
		gl.uniform3fv(at.back, theme.back);
		gl.bindVertexArray(null);
		gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
	}
}
