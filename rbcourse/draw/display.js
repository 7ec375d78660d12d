// Draw what display.py has kept. A state is drawn over the picture of what does not move.
const rbcourseDisplay = {
  // What the addresses of the states and of the picture hold.
  async load(states, picture) {
    const bytes = Uint8Array.from(atob(states.split(",")[1]), (letter) => letter.charCodeAt(0));
    const back = Object.assign(new Image(), { src: picture });
    await back.decode();
    return { states: await rbcourseDisplay.unpack(bytes), back };
  },

  // All states of bytes that are deflated: an array of numbers each.
  async unpack(bytes) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const buffer = await new Response(stream).arrayBuffer();
    const [count] = new Uint32Array(buffer, 0, 1);
    const sizes = new Uint32Array(buffer, 4, count), numbers = new Int16Array(buffer, 4 * (count + 1));
    let end = 0;
    return [...sizes].map((size) => numbers.subarray(end, (end += size)));
  },

  // `still` is a loaded image; the canvas is as fine as the screen shows it.
  draw(canvas, still, [width, height], styles, state) {
    const zoom = (window.devicePixelRatio * (canvas.clientWidth || width)) / width;
    canvas.width = Math.round(width * zoom);
    canvas.height = Math.round(height * zoom);
    const ink = canvas.getContext("2d");
    ink.scale(zoom, zoom);
    ink.drawImage(still, 0, 0, width, height);
    for (let i = 0; i < state.length; ) {
      const [fill, stroke, line, dashes, lineCap, lineJoin, clip] = styles[state[i]];
      const path = new Path2D();
      do {
        const end = i + 2 + 2 * Math.abs(state[i + 1]);
        let x = 0, y = 0;
        for (let k = i + 2; k < end; k += 2) {
          x += state[k] / 16;
          y += state[k + 1] / 16;
          if (k === i + 2) path.moveTo(x, y);
          else path.lineTo(x, y);
        }
        i = end;
      } while (state[i + 1] < 0);
      ink.save();
      if (clip.length) {
        ink.beginPath();
        ink.rect(...clip);
        ink.clip();
      }
      Object.assign(ink, { fillStyle: fill, strokeStyle: stroke, lineWidth: line, lineCap, lineJoin });
      if (fill) ink.fill(path);
      ink.setLineDash(dashes);
      if (stroke) ink.stroke(path);
      ink.restore();
    }
  },
};
