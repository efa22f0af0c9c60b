// Mouse, touch and keys of a drawing.
'use strict';
const LoopbenchControls = (() => {
  // Mouse, touch and keys. `on` may have onHover(item, x, y), onPick(item), onKey(event) that says
  // whether it took the key, and changed(), called in place of draw().
  function attach(drawing, on = {}) {
    const canvas = drawing.canvas, pointers = new Map();
    const changed = on.changed || (() => drawing.draw());
    const at = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    let moved = 0;
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, at(event));
      moved = 0;
    });
    canvas.addEventListener('pointermove', (event) => {
      const now = at(event), before = pointers.get(event.pointerId);
      if (!before) {
        if (on.onHover) on.onHover(drawing.pick(now[0], now[1]), now[0], now[1]);
        return;
      }
      const dx = now[0] - before[0], dy = now[1] - before[1];
      moved += Math.hypot(dx, dy);
      if (pointers.size === 2) {
        const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
        const was = Math.hypot(before[0] - other[0], before[1] - other[1]);
        const is = Math.hypot(now[0] - other[0], now[1] - other[1]);
        drawing.pan(0.5 * dx, 0.5 * dy);
        if (was > 0) drawing.zoom(is / was, 0.5 * (now[0] + other[0]), 0.5 * (now[1] + other[1]));
      } else if (drawing.picture.planar || event.shiftKey || event.buttons === 2 || event.buttons === 4) {
        drawing.pan(dx, dy);
      } else {
        drawing.orbit(-dx * 0.008, -dy * 0.008);
      }
      pointers.set(event.pointerId, now);
      changed();
    });
    const ended = (event) => {
      const [x, y] = at(event);
      if (pointers.delete(event.pointerId) && moved < 5 && event.type === 'pointerup' && on.onPick) {
        on.onPick(drawing.pick(x, y, event.pointerType === 'touch' ? 14 : 6));
      }
    };
    canvas.addEventListener('pointerup', ended);
    canvas.addEventListener('pointercancel', ended);
    canvas.addEventListener('pointerleave', () => on.onHover && on.onHover(-1, 0, 0));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const [x, y] = at(event);
      drawing.zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode === 1 ? 20 : 1)), x, y);
      changed();
    }, {passive: false});
    canvas.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key];
      if (arrow && (drawing.picture.planar || event.shiftKey)) drawing.pan(-40 * arrow[0], -40 * arrow[1]);
      else if (arrow) drawing.orbit(0.12 * arrow[0], 0.12 * arrow[1]);
      else if (event.key === '+' || event.key === '=') drawing.zoom(1.25);
      else if (event.key === '-') drawing.zoom(0.8);
      else if (event.key === '0') drawing.fit();
      else if (!(on.onKey && on.onKey(event))) return;
      event.preventDefault();
      changed();
    });
  }

  return {attach};
})();
