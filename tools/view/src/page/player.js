// Plays the recording: time, controls, keys, mouse and touch.

const element = id => document.getElementById(id);

// A software renderer is as fast as it has few pixels: below this the picture gets coarser.
const PICTURES_WANTED = 33;
const COARSEST = 0.4;
const END_SHOWN = 1; // Seconds that the last frame stays.
const SAME_FRAME = 1e-6; // Seconds.

class Player {
	constructor(recording) {
		const { head } = recording;
		this.recording = recording;
		this.between = new Between(recording);
		this.colouring = new Colouring(recording);
		this.canvas = element("picture");
		this.painter = new Painter(this.canvas, head, recording.kinds);
		this.camera = new Camera(head.view.low, head.view.high);
		this.live = head.live === true;
		this.time = 0;
		this.resolution = 1;
		this.pictures = 0;
		this.playing = false;
		if (this.live) element("rate").parentElement.hidden = true;
		this.setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
		this.setColour(head.kinds.length > 1 ? "kind" : "speed");
		this.listen();
		this.setPlaying(!matchMedia("(prefers-reduced-motion: reduce)").matches);
		requestAnimationFrame(now => this.picture(now));
	}

	get begin() {
		return this.recording.times[0];
	}

	get end() {
		return this.recording.times.at(-1);
	}

	// The run has ended: from now on its frames play as the ones of a recording.
	endLive() {
		this.live = false;
		element("rate").parentElement.hidden = false;
		this.dirty = true;
	}

	setTheme(theme) {
		this.theme = theme;
		document.documentElement.dataset.theme = theme;
		this.dirty = true;
	}

	setColour(name) {
		this.colour = name;
		element("colour").value = name;
		const { kinds } = this.recording.head;
		element("legend-kinds").replaceChildren(...(name === "kind" ? kinds : []).map(kind => {
			const item = document.createElement("span");
			item.style.setProperty("--of", `rgb(${kind.colour.join(" ")})`);
			item.textContent = kind.name;
			return item;
		}));
		element("legend-scale").hidden = name === "kind";
		if (name !== "kind") {
			const colours = ramp(name);
			const pen = element("legend-ramp").getContext("2d");
			for (let x = 0; x < 160; x++) {
				const at = 4 * Math.round(x / 159 * 255);
				pen.fillStyle = `rgb(${colours[at]} ${colours[at + 1]} ${colours[at + 2]})`;
				pen.fillRect(x, 0, 1, 10);
			}
		}
		this.dirty = true;
	}

	setPlaying(playing) {
		if (playing && !this.live && this.time >= this.end) this.setTime(this.begin);
		this.atEnd = 0;
		this.playing = playing && (this.live || this.end > this.begin);
		element("play").textContent = this.playing ? "Pause" : "Play";
		this.measured = null;
		this.dirty = true;
	}

	setTime(time) {
		this.time = Math.min(Math.max(time, this.begin), this.end);
		this.dirty = true;
	}

	// Goes to the next frame, or to the one before.
	stepFrames(direction) {
		const { times } = this.recording;
		this.setPlaying(false);
		const frame = direction > 0
			? times.findIndex(time => time > this.time + SAME_FRAME)
			: times.findLastIndex(time => time < this.time - SAME_FRAME);
		if (frame >= 0) this.setTime(times[frame]);
	}

	// One picture of the browser's rhythm.
	picture(now) {
		requestAnimationFrame(later => this.picture(later));
		const passed = Math.min(now - (this.last ?? now), 200) / 1000;
		this.last = now;
		if (this.playing) {
			this.advance(passed);
			this.measure(now);
		}
		this.resize();
		if (this.dirty) this.draw();
	}

	// Plays on, and from the beginning after a look at the end; a run that steps plays its newest frame.
	advance(passed) {
		if (this.live) {
			if (this.time !== this.end) this.setTime(this.end);
			return;
		}
		this.atEnd = this.time < this.end ? 0 : this.atEnd + passed;
		if (this.atEnd > END_SHOWN) this.setTime(this.begin);
		else this.setTime(this.time + passed * Number(element("rate").value));
	}

	draw() {
		this.dirty = false;
		const moment = this.between.at(this.time);
		const colours = this.colouring.at(this.colour, moment);
		this.painter.draw(moment.poses, colours, this.camera, THEMES[this.theme]);
		this.pictures++;
		const [title, low = "", high = ""] = this.colouring.legend(this.colour);
		element("legend-title").textContent = title;
		element("legend-low").textContent = low;
		element("legend-high").textContent = high;
		const scrub = element("scrub");
		[scrub.min, scrub.max, scrub.step] = [this.begin, this.end, Math.max(this.end - this.begin, 1e-3) / 2000];
		if (document.activeElement !== scrub || this.playing) scrub.value = this.time;
		element("time").value = `${this.time.toFixed(2)} of ${this.end.toFixed(2)} s`;
	}

	// Measures frames a second, and adapts the number of pixels to them.
	measure(now) {
		if (!this.measured) {
			this.measured = { since: now, pictures: this.pictures };
			return;
		}
		const seconds = (now - this.measured.since) / 1000;
		if (seconds < 0.5) return;
		const rate = (this.pictures - this.measured.pictures) / seconds;
		this.measured = { since: now, pictures: this.pictures };
		if (rate < PICTURES_WANTED && this.resolution > COARSEST) {
			this.resolution = Math.max(COARSEST, this.resolution * 0.8);
		}
		const coarser = this.resolution < 1 ? ", coarser to keep up" : "";
		element("rhythm").value = `${rate.toFixed(0)} frames a second${coarser}`;
	}

	resize() {
		const scale = this.resolution * Math.min(devicePixelRatio, 2);
		const width = Math.max(Math.round(this.canvas.clientWidth * scale), 1);
		const height = Math.max(Math.round(this.canvas.clientHeight * scale), 1);
		if (this.canvas.width === width && this.canvas.height === height) return;
		this.canvas.width = width;
		this.canvas.height = height;
		this.dirty = true;
	}

	screenshot() {
		// The picture is there only until the browser shows it.
		this.draw();
		this.canvas.toBlob(blob => {
			const link = document.createElement("a");
			link.href = URL.createObjectURL(blob);
			link.download = `zynq-pgs-${this.time.toFixed(2)}s.png`;
			link.click();
			URL.revokeObjectURL(link.href);
		});
	}

	act(key) {
		const colours = element("colour");
		const actions = {
			" ": () => this.setPlaying(!this.playing),
			",": () => this.stepFrames(-1),
			".": () => this.stepFrames(1),
			Home: () => this.setTime(this.begin),
			End: () => this.setTime(this.end),
			"+": () => this.camera.zoom(1 / 1.2),
			"=": () => this.camera.zoom(1 / 1.2),
			"-": () => this.camera.zoom(1.2),
			0: () => this.camera.reset(),
			c: () => this.setColour(colours.options[(colours.selectedIndex + 1) % colours.options.length].value),
			s: () => this.screenshot(),
			t: () => this.setTheme(this.theme === "dark" ? "light" : "dark"),
		};
		const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
		const focus = document.activeElement;
		if (turns[key] && (focus === this.canvas || focus === document.body)) this.camera.turn(...turns[key]);
		else if (actions[key]) actions[key]();
		else return false;
		this.dirty = true;
		return true;
	}

	listen() {
		element("controls").addEventListener("submit", event => event.preventDefault());
		element("play").addEventListener("click", () => this.setPlaying(!this.playing));
		element("scrub").addEventListener("input", event => {
			this.setPlaying(false);
			this.setTime(Number(event.target.value));
		});
		element("colour").addEventListener("change", event => this.setColour(event.target.value));
		element("screenshot").addEventListener("click", () => this.screenshot());
		element("theme").addEventListener("click", () => this.act("t"));
		addEventListener("keydown", event => {
			if (event.ctrlKey || event.metaKey || event.altKey) return;
			// Controls keep the keys that they use themselves.
			const focus = event.target.tagName;
			if (focus === "SELECT" || (["BUTTON", "SUMMARY"].includes(focus) && event.key === " ")) return;
			if (focus === "INPUT" && /^(Arrow|Home|End)/.test(event.key)) return;
			const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
			if (this.act(key)) event.preventDefault();
		});
		this.listenToPointers();
	}

	listenToPointers() {
		const canvas = this.canvas;
		const pointers = new Map();
		const middle = () => {
			const all = [...pointers.values()];
			const x = all.reduce((sum, at) => sum + at.x, 0) / all.length;
			const y = all.reduce((sum, at) => sum + at.y, 0) / all.length;
			return { x, y, spread: Math.hypot(all[0].x - x, all[0].y - y) };
		};
		canvas.addEventListener("pointerdown", event => {
			canvas.setPointerCapture(event.pointerId);
			pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
			canvas.focus();
		});
		canvas.addEventListener("pointermove", event => {
			if (!pointers.has(event.pointerId)) return;
			const before = middle();
			pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
			const after = middle();
			const height = canvas.clientHeight;
			const [x, y] = [(after.x - before.x) / height, (after.y - before.y) / height];
			if (pointers.size > 1 || event.buttons === 2 || event.shiftKey) this.camera.move(x, y);
			else this.camera.turn(-4 * x, 4 * y);
			if (pointers.size > 1 && after.spread > 0) this.camera.zoom(before.spread / after.spread);
			this.dirty = true;
		});
		for (const name of ["pointerup", "pointercancel"]) {
			canvas.addEventListener(name, event => pointers.delete(event.pointerId));
		}
		canvas.addEventListener("contextmenu", event => event.preventDefault());
		canvas.addEventListener("wheel", event => {
			event.preventDefault();
			this.camera.zoom(Math.exp(0.001 * event.deltaY));
			this.dirty = true;
		}, { passive: false });
	}
}
