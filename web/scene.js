// Draws the picture of a mechanism (harness/figures/view.h, as JSON) on a canvas, for any poses of
// its bodies. No page, no network, no library: pages are made with it (view.js is one).
//
//   const drawing = new LoopbenchScene.Drawing(canvas, picture);
//   LoopbenchScene.attach(drawing, {onHover(item) {..}});      // mouse, touch and keys
//   drawing.poses = LoopbenchScene.between(picture, frames, 3.5);
//   drawing.ghosts = [{poses, colour: '--second'}];            // others of the same bodies, as outlines
//   drawing.traces = [{paths: LoopbenchScene.paths(picture, frames), colour: '--drive'}];  // of named points
//   drawing.draw();
//
// Poses are flat numbers by body, Ground first: x, y, angle in the plane; x, y, z and the quaternion
// w, x, y, z in space. Colours are custom properties of the canvas' style sheet (scene.css).
'use strict';
const LoopbenchScene = (() => {
  const TURN = 2 * Math.PI;
  const {between, frameAt, matrices, paths, placed} = LoopbenchPoses;
  const {paint, fromSegment} = LoopbenchSymbols;
  const {attach} = LoopbenchControls;

  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
  const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));

  // One, two or five times a power of ten, at most `longest`.
  function roundLength(longest) {
    const decade = Math.pow(10, Math.floor(Math.log10(longest)));
    for (const step of [5, 2]) if (step * decade <= longest) return step * decade;
    return decade;
  }

  const TOLD_APART = 2e4;  // shapes above which small ones are left out of hovering

  class Drawing {
    constructor(canvas, picture) {
      this.canvas = canvas;
      this.picture = picture;
      this.poses = picture.start;
      this.ghosts = [];
      this.traces = [];          // paths of the picture's named points
      this.gaps = false;         // how open loops are in the file
      this.names = true;
      this.centres = true;
      this.highlight = new Set();  // items
      this.R = picture.view.map((row) => row.slice());  // right, up, towards the viewer
      this.density = 0;          // of pixels; 0: the screen's own
      this.resize();
      this.fit();
    }

    // Takes the canvas' size in the page.
    resize() {
      const box = this.canvas.getBoundingClientRect();
      const density = this.density || window.devicePixelRatio || 1;
      this.width = Math.max(1, box.width || this.canvas.width);
      this.height = Math.max(1, box.height || this.canvas.height);
      this.canvas.width = Math.round(this.width * density);
      this.canvas.height = Math.round(this.height * density);
      this.context = this.canvas.getContext('2d');
      this.context.setTransform(density, 0, 0, density, 0, 0);
    }

    // Shows all places of the poses given, or of those drawn.
    fit(list) {
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], p = [0, 0, 0];
      for (const poses of list || [this.poses, ...this.ghosts.map((ghost) => ghost.poses)]) {
        const X = matrices(this.picture, poses);
        for (const shape of this.picture.shapes) {
          for (let i = 0; i < shape.at.length; i += 4) {
            placed(X, shape.at, i, shape.offsets, p);
            for (let j = 0; j < 3; ++j) {
              const v = dot(this.R[j], p);
              if (v < low[j]) low[j] = v;
              if (v > high[j]) high[j] = v;
            }
          }
        }
      }
      if (!(low[0] <= high[0])) low.fill(0), high.fill(0);
      const around = 5 * this.picture.symbol;
      const wide = high[0] - low[0] + around || 1, tall = high[1] - low[1] + around || 1;
      const footer = Math.min(64, 0.2 * this.height);
      this.scale = 0.9 * Math.min(this.width / wide, (this.height - footer) / tall);
      this.fitted = this.scale;
      this.centre = [0, 0, 0];
      for (let j = 0; j < 3; ++j) {
        for (let k = 0; k < 3; ++k) this.centre[k] += this.R[j][k] * 0.5 * (low[j] + high[j]);
      }
      this.shiftY = -0.5 * footer;
    }

    // By angles [rad] about what is up, and about what is right.
    orbit(about, over) {
      if (this.picture.planar) return;
      const turned = (v, axis, angle) => {
        const c = Math.cos(angle), s = Math.sin(angle), k = dot(axis, v) * (1 - c), w = cross(axis, v);
        return [0, 1, 2].map((j) => v[j] * c + w[j] * s + axis[j] * k);
      };
      const right = this.R[0];
      const tilted = turned(this.R[2], right, over);
      const viewer = unit(turned(tilted, this.picture.up, about));
      const across = unit(turned(right, this.picture.up, about));
      this.R = [across, cross(viewer, across), viewer];
    }

    pan(dx, dy) {
      for (let j = 0; j < 3; ++j) {
        this.centre[j] += (-dx * this.R[0][j] + dy * this.R[1][j]) / this.scale;
      }
    }

    // About a point of the canvas.
    zoom(factor, x = 0.5 * this.width, y = 0.5 * this.height + this.shiftY) {
      const after = Math.max(1e-3 * this.fitted, Math.min(1e6 * this.fitted, this.scale * factor));
      const dx = x - 0.5 * this.width, dy = y - 0.5 * this.height - this.shiftY;
      this.pan(-dx, -dy);
      this.scale = after;
      this.pan(dx, dy);
    }

    see(p) {
      const v = [p[0] - this.centre[0], p[1] - this.centre[1], p[2] - this.centre[2]];
      return [0.5 * this.width + this.scale * dot(this.R[0], v),
              0.5 * this.height + this.shiftY - this.scale * dot(this.R[1], v), dot(this.R[2], v)];
    }

    draw() {
      const style = getComputedStyle(this.canvas), known = new Map();
      this.colour = (name) => {
        if (!known.has(name)) known.set(name, style.getPropertyValue(name).trim() || '#888');
        return known.get(name);
      };
      const g = this.context;
      g.fillStyle = this.colour('--paper');
      g.fillRect(0, 0, this.width, this.height);
      this.taken = [];
      for (const ghost of this.ghosts) this.drawGhost(ghost);
      for (const trace of this.traces) this.drawTrace(trace);
      this.drawn = this.project(matrices(this.picture, this.poses));
      for (const one of this.drawn) paint(this, one);
      this.drawMarks();
      if (this.gaps) this.drawGaps();
      if (this.names) this.drawNames();
      this.drawFooter();
    }

    // Shapes on the canvas, the farthest first.
    project(X) {
      const list = [], p = [0, 0, 0], gone = this.picture.items;
      for (const shape of this.picture.shapes) {
        if (shape.style === 'centre' && !this.centres) continue;
        const spots = [];
        let depth = 0, left = Infinity, right = -Infinity, top = Infinity, bottom = -Infinity;
        for (let i = 0; i < shape.at.length; i += 4) {
          const spot = this.see(placed(X, shape.at, i, shape.offsets, p));
          spots.push(spot);
          depth += spot[2];
          left = Math.min(left, spot[0]); right = Math.max(right, spot[0]);
          top = Math.min(top, spot[1]); bottom = Math.max(bottom, spot[1]);
        }
        const radius = shape.radius * this.scale;
        if (right < -radius || left > this.width + radius || bottom < -radius || top > this.height + radius) continue;
        const size = Math.max(right - left, bottom - top) + 2 * radius;
        if (!(size > 0.3) && this.picture.shapes.length > 3000) continue;
        depth = depth / spots.length + shape.lift * this.picture.symbol;
        list.push({shape, spots, depth, radius, size, gone: gone[shape.item].gone !== ''});
      }
      if (!this.picture.planar) list.sort((a, b) => a.depth - b.depth);
      return list;
    }

    drawTrace({paths, colour}) {
      const g = this.context;
      g.strokeStyle = this.colour(colour);
      g.lineWidth = 1.2;
      for (const path of paths) {
        g.beginPath();
        for (let i = 0; i < path.length; i += 3) {
          const s = this.see(path.subarray(i, i + 3));
          if (i) g.lineTo(s[0], s[1]); else g.moveTo(s[0], s[1]);
        }
        g.stroke();
      }
    }

    drawGhost({poses, colour}) {
      const g = this.context, X = matrices(this.picture, poses), p = [0, 0, 0];
      g.strokeStyle = this.colour(colour || '--ghost');
      g.lineWidth = 1.6;
      g.setLineDash([6, 4]);
      for (const shape of this.picture.shapes) {
        const area = shape.kind === 'area' && shape.style !== 'ground';
        if (!area && (shape.style !== 'body' || shape.kind !== 'bar')) continue;
        g.beginPath();
        for (let i = 0; i < shape.at.length; i += 4) {
          const s = this.see(placed(X, shape.at, i, shape.offsets, p));
          if (i) g.lineTo(s[0], s[1]); else g.moveTo(s[0], s[1]);
        }
        if (shape.kind === 'area') g.closePath();
        g.stroke();
      }
      g.setLineDash([]);
    }

    // Rings about joints that impose what others impose, and the loops that these are in.
    drawMarks() {
      const g = this.context;
      g.strokeStyle = this.colour('--mark');
      g.globalAlpha = 0.35;
      g.lineWidth = 5;
      for (const loop of this.picture.loops) {
        if (loop.redundant.length === 0) continue;
        g.beginPath();
        loop.joints.forEach((joint, i) => {
          const s = this.anchor(this.picture.items[this.picture.bodies + joint]);
          if (i) g.lineTo(s[0], s[1]); else g.moveTo(s[0], s[1]);
        });
        g.closePath();
        g.stroke();
      }
      g.globalAlpha = 1;
      g.lineWidth = 1.8;
      g.setLineDash([3, 2]);
      for (const item of this.picture.items) {
        if (item.redundant.length === 0) continue;
        const s = this.anchor(item);
        g.beginPath();
        g.arc(s[0], s[1], Math.max(8, 2.4 * this.picture.symbol * this.scale), 0, TURN);
        g.stroke();
      }
      g.setLineDash([]);
    }

    anchor(item, poses = this.poses) {
      if (this.anchorPoses !== poses) {
        this.anchorPoses = poses;
        this.anchorX = matrices(this.picture, poses);
      }
      return this.see(placed(this.anchorX, item.anchor, 0, null, [0, 0, 0]));
    }

    drawGaps() {
      const g = this.context, X = matrices(this.picture, this.picture.given);
      for (const loop of this.picture.loops) {
        if (!(loop.gap > 1e-9 * this.picture.extent)) continue;
        const a = this.see(placed(X, loop.from, 0, loop.offset, [0, 0, 0]));
        const b = this.see(placed(X, loop.to, 0, null, [0, 0, 0]));
        g.strokeStyle = this.colour('--gap');
        g.lineWidth = 2.2;
        g.setLineDash([3, 3]);
        g.beginPath();
        g.moveTo(a[0], a[1]);
        g.lineTo(b[0], b[1]);
        g.stroke();
        g.setLineDash([]);
        for (const s of [a, b]) {
          g.beginPath();
          g.moveTo(s[0] - 4, s[1] - 4); g.lineTo(s[0] + 4, s[1] + 4);
          g.moveTo(s[0] + 4, s[1] - 4); g.lineTo(s[0] - 4, s[1] + 4);
          g.stroke();
        }
        const joint = this.picture.items[this.picture.bodies + loop.joint];
        this.write(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]),
                   short(joint.name) + ' open by ' + number(loop.gap) + ' m', '--gap', 6);
      }
    }

    // Where pins can be told apart: elsewhere names would be of what nobody sees.
    drawNames() {
      if (this.picture.joints > 150 && this.picture.symbol * this.scale < 1) return;
      const items = this.picture.items.slice(1, this.picture.bodies + this.picture.joints);
      const pin = Math.max(4, 1.2 * this.picture.symbol * this.scale);
      const seen = [];
      for (const item of items) {
        const s = this.anchor(item);
        if (s[0] < 0 || s[0] > this.width || s[1] < 0 || s[1] > this.height) continue;
        if (seen.length >= 150) break;
        seen.push([item, s]);
        this.taken.push([s[0] - 0.7 * pin, s[1] - 0.7 * pin, s[0] + 0.7 * pin, s[1] + 0.7 * pin]);
      }
      for (const [item, s] of seen) {
        this.write(s[0], s[1], short(item.name), item.kind === 'body' ? '--bodyname' : '--line', pin);
      }
    }

    // Beside a point where nothing is written yet, else nowhere.
    write(x, y, text, colour, off) {
      const g = this.context;
      g.font = '12px system-ui, "DejaVu Sans", sans-serif';
      const wide = g.measureText(text).width, high = 12;
      for (const [right, down] of [[1, -1], [-1, -1], [1, 1], [-1, 1], [0, -1], [0, 1], [1, 0], [-1, 0],
                                   [1, -2.2], [-1, -2.2], [1, 2.2], [-1, 2.2]]) {
        const left = x + (right > 0 ? off : right < 0 ? -off - wide : -0.5 * wide);
        const top = y + down * (off + (down < 0 ? high : 0)) - (down === 0 ? 0.5 * high : 0);
        const box = [left, top, left + wide, top + high];
        if (box[0] < 2 || box[2] > this.width - 2 || box[1] < 2 || box[3] > this.height - 2) continue;
        if (this.taken.some((b) => b[0] < box[2] && box[0] < b[2] && b[1] < box[3] && box[1] < b[3])) continue;
        this.taken.push(box);
        this.letters(text, left, top + 10, colour);
        return;
      }
    }

    letters(text, x, y, colour) {
      const g = this.context;
      g.lineWidth = 3;
      g.lineJoin = 'round';
      g.strokeStyle = this.colour('--paper');
      g.strokeText(text, x, y);
      g.fillStyle = this.colour(colour);
      g.fillText(text, x, y);
    }

    // Scale, axes, gravity.
    drawFooter() {
      const g = this.context, y = this.height - 26;
      const length = roundLength(0.28 * this.width / this.scale), px = length * this.scale;
      g.strokeStyle = this.colour('--line');
      g.lineWidth = 1.4;
      g.beginPath();
      g.moveTo(18, y - 4); g.lineTo(18, y + 4);
      g.moveTo(18, y); g.lineTo(18 + px, y);
      g.moveTo(18 + px, y - 4); g.lineTo(18 + px, y + 4);
      g.stroke();
      g.font = '12px system-ui, "DejaVu Sans", sans-serif';
      this.letters(number(length) + ' m', 24 + px, y + 4, '--line');
      const pointer = (x, from, d, name, colour) => {
        const way = Math.hypot(d[0], d[1]), tip = [x + 24 * d[0], from - 24 * d[1]];
        g.strokeStyle = g.fillStyle = this.colour(colour);
        g.lineWidth = 1.4;
        g.beginPath();
        if (way < 0.05) g.arc(x, from, 2, 0, TURN);
        const u = [d[0] / (way || 1), -d[1] / (way || 1)], head = 6 * Math.min(1, way);
        g.moveTo(x, from); g.lineTo(tip[0], tip[1]);
        g.moveTo(tip[0] - head * (u[0] - 0.5 * u[1]), tip[1] - head * (u[1] + 0.5 * u[0]));
        g.lineTo(tip[0], tip[1]);
        g.lineTo(tip[0] - head * (u[0] + 0.5 * u[1]), tip[1] - head * (u[1] - 0.5 * u[0]));
        g.stroke();
        this.letters(name, tip[0] + 8 * (way < 0.05 ? 1 : d[0]) - 3, tip[1] - 8 * d[1] + 4, colour);
      };
      const axes = this.picture.planar ? ['x', 'y'] : ['x', 'y', 'z'];
      axes.forEach((name, i) => pointer(this.width - 96, y, [this.R[0][i], this.R[1][i]], name, '--line'));
      const gravity = this.picture.gravity, size = Math.hypot(...gravity);
      if (size > 0) {
        const d = unit(gravity);
        pointer(this.width - 28, y - 14, [dot(this.R[0], d), dot(this.R[1], d)], 'g', '--soft');
      }
    }

    // The item at a point of the canvas, -1 for none.
    pick(x, y, reach = 6) {
      const drawn = this.drawn || [];
      if (drawn.length > TOLD_APART) return -1;
      for (let i = drawn.length - 1; i >= 0; --i) {
        const {shape, spots, radius} = drawn[i];
        if (shape.style === 'ground') continue;
        const closed = shape.kind === 'area';
        let near = spots.length === 1 ? Math.hypot(x - spots[0][0], y - spots[0][1]) : Infinity, inside = false;
        for (let k = closed ? 0 : 1; k < spots.length; ++k) {
          const a = spots[(k || spots.length) - 1], b = spots[k];
          near = Math.min(near, fromSegment(x, y, a, b));
          if ((a[1] > y) !== (b[1] > y) && x < a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1])) inside = !inside;
        }
        if ((closed && inside) || near <= radius + reach) return shape.item;
      }
      return -1;
    }
  }

  const number = (value) => String(Number(value.toPrecision(3)));
  const short = (name) => (Array.from(name).length > 20 ? Array.from(name).slice(0, 20).join('') + '\u2026' : name);

  return {Drawing, attach, between, frameAt, matrices, number, paths, short};
})();
