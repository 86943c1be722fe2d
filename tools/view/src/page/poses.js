// Poses between two frames: the positions on a straight line, the orientations on the shorter arc,
// normalised.

class Between {
	constructor(recording) {
		this.recording = recording;
		this.slots = [0, 1].map(() => ({ frame: null, poses: new Float32Array(7 * recording.bodies) }));
		this.poses = new Float32Array(7 * recording.bodies);
	}

	// The decoded poses of a frame; keeps the ones of the frame `beside`.
	decoded(index, other) {
		const [frame, beside] = [this.recording.frames[index], this.recording.frames[other]];
		let slot = this.slots.find(slot => slot.frame === frame);
		if (!slot) {
			slot = this.slots.find(slot => slot.frame !== beside);
			this.recording.poses(frame, slot.poses);
			slot.frame = frame;
		}
		return slot.poses;
	}

	// The poses at a time, and the frames around it.
	at(time) {
		const { times } = this.recording;
		let frame = 0;
		while (frame + 2 < times.length && times[frame + 1] <= time) frame++;
		const next = Math.min(frame + 1, times.length - 1);
		const length = times[next] - times[frame];
		const fraction = length > 0 ? Math.min(Math.max((time - times[frame]) / length, 0), 1) : 0;
		const before = this.decoded(frame, next);
		const after = this.decoded(next, frame);
		const rest = 1 - fraction;
		const out = this.poses;
		for (let at = 0; at < out.length; at += 7) {
			for (let k = at; k < at + 3; k++) out[k] = rest * before[k] + fraction * after[k];
			const cosine = before[at + 3] * after[at + 3] + before[at + 4] * after[at + 4] +
				before[at + 5] * after[at + 5] + before[at + 6] * after[at + 6];
			// q and -q are one orientation.
			const towards = cosine < 0 ? -fraction : fraction;
			const x = rest * before[at + 3] + towards * after[at + 3];
			const y = rest * before[at + 4] + towards * after[at + 4];
			const z = rest * before[at + 5] + towards * after[at + 5];
			const w = rest * before[at + 6] + towards * after[at + 6];
			const scale = 1 / Math.sqrt(x * x + y * y + z * z + w * w);
			out[at + 3] = scale * x;
			out[at + 4] = scale * y;
			out[at + 5] = scale * z;
			out[at + 6] = scale * w;
		}
		return { poses: out, frame, next, fraction };
	}
}
