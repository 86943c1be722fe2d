// Begins to play: the frames of the page, or the frames that its server sends while a board steps.

// Receives frames until the run ends or the server is gone; resolves at the first one.
function receive(recording) {
	const source = new EventSource("frames");
	const state = element("state");
	const over = text => {
		source.close();
		state.value = text;
		recording.head.live = false;
		window.player?.endLive();
	};
	return new Promise((first, never) => {
		source.addEventListener("message", ({ data }) => {
			const frame = JSON.parse(data);
			recording.receive(frame);
			state.value = `${frame.ended ? "Ended" : "Live"}: ${frame.note}`;
			if (frame.ended) over(state.value);
			first();
		});
		source.addEventListener("error", () => {
			over("No more frames: the run is gone, or this page could not keep up.");
			never(new Error("the run has ended, or has as many readers as it serves"));
		});
	});
}

async function begin() {
	const message = element("message");
	message.hidden = false;
	try {
		const head = JSON.parse(element("head").textContent);
		const recording = new Recording(head);
		message.textContent = head.live ? "Waiting for a step ..." : "Reading the poses ...";
		if (head.live) await receive(recording);
		else recording.read(await inflate(bytesOfBase64(element("poses").textContent)));
		window.player = new Player(recording);
		message.hidden = true;
	} catch (error) {
		message.textContent = `This page cannot play: ${error.message}.`;
		console.error(error);
	}
}

begin();
