// The mechanism at the time that all plots show; a second motion of it as an outline.
'use strict';
const LoopbenchMotion = (() => {
  const {make, button, select, number} = LoopbenchParts;

  class Motion {
    constructor(host, clock) {
      Object.assign(this, {clock, scene: null, first: null, second: null, playing: false});
      this.canvas = make('canvas', {class: 'linkage', tabindex: '0', role: 'img', 'aria-label': 'The mechanism'});
      this.missing = make('p', {class: 'missing'});
      this.slider = make('input', {type: 'range', min: '0', max: '1', step: 'any', value: '0', 'aria-label': 'Time [s]'});
      this.slider.addEventListener('input', () => { this.play(false); clock.set(Number(this.slider.value), this); });
      this.player = button('Play', () => this.play(!this.playing), {'aria-pressed': 'false'});
      this.said = make('p', {class: 'soft', role: 'status'});
      this.choices = make('div', {class: 'row'});
      this.controls = make('div', {}, make('div', {class: 'row'}, this.player, this.slider), this.choices);
      host.append(make('figure', {}, make('figcaption', {}, make('b', {}, 'Mechanism')), this.missing, this.canvas,
                       this.controls, this.said));
      clock.listen(() => this.draw());
      new ResizeObserver(() => {
        if (!this.drawing || this.canvas.hidden) return;
        this.drawing.resize();
        this.drawing.fit();
        this.draw();
      }).observe(this.canvas);
    }

    show(scene) {
      this.play(false);
      this.scene = scene;
      const paths = scene ? scene.paths : [];
      this.missing.textContent = scene ? scene.missing : '';
      this.canvas.hidden = !scene || !scene.picture;
      this.controls.hidden = paths.length === 0;
      this.first = paths[0] || null;
      this.second = null;
      this.said.textContent = '';
      if (this.canvas.hidden) return;
      // a drawing's controls stay with its canvas, so each scene has a canvas of its own
      const canvas = this.canvas.cloneNode();
      this.canvas.replaceWith(canvas);
      this.canvas = canvas;
      canvas.setAttribute('aria-label', 'Drawing of ' + scene.picture.name);
      this.drawing = new LoopbenchScene.Drawing(canvas, scene.picture);
      LoopbenchScene.attach(this.drawing, {
        changed: () => this.drawing.draw(),
        onKey: (event) => (event.key === ' ' ? (this.play(!this.playing), true) : false)});
      const labels = paths.map((path) => path.label);
      this.one = select('motion of', labels, (i) => { this.first = paths[i]; this.fit(); });
      this.other = select('beside', ['nothing', ...labels], (i) => { this.second = i ? paths[i - 1] : null; this.fit(); });
      this.part = button('Where they part', () => this.findParting());
      this.choices.replaceChildren(this.one.element, ...(paths.length > 1 ? [this.other.element, this.part] : []));
      this.part.disabled = true;
      if (paths.length > 0 && scene.picture.points.length > 0) {
        this.traced = make('input', {type: 'checkbox'});
        this.traced.addEventListener('change', () => { this.trace(); this.draw(); });
        this.choices.append(make('label', {}, this.traced, ' paths of named points'));
      } else {
        this.traced = null;
      }
      this.fit();
    }

    // The motion of a row of the table, if there is one.
    choose(row) {
      const at = this.scene ? this.scene.paths.findIndex((path) => path.row === row) : -1;
      if (at < 0) return;
      this.first = this.scene.paths[at];
      this.one.list.value = String(at);
      this.fit();
    }

    fit() {
      this.part.disabled = !this.second || this.second === this.first;
      if (this.first) {
        const some = (path) => [0, 0.25, 0.5, 0.75, 1].map((s) => path.frames[Math.round(s * (path.frames.length - 1))]);
        this.drawing.fit([...some(this.first), ...(this.second ? some(this.second) : [])]);
      }
      this.trace();
      this.slider.max = String(this.clock.end);
      this.draw();
    }

    // Paths of named points in the motions that are shown.
    trace() {
      this.drawing.traces = [[this.first, '--drive'], [this.second, '--second']]
          .filter(([path]) => path && this.traced && this.traced.checked)
          .map(([path, colour]) => ({paths: LoopbenchScene.paths(this.scene.picture, path.frames), colour}));
    }

    posesAt(path, t) {
      return LoopbenchScene.between(this.scene.picture, path.frames, LoopbenchScene.frameAt(path.times, t));
    }

    // The largest distance of a drawn place in one pose from the same in the other [m].
    apart(a, b) {
      const A = LoopbenchPoses.matrices(this.scene.picture, a), B = LoopbenchPoses.matrices(this.scene.picture, b);
      const p = [0, 0, 0], q = [0, 0, 0];
      let most = 0;
      for (const shape of this.scene.picture.shapes) {
        if (shape.style !== 'body' && shape.style !== 'joint') continue;
        for (let i = 0; i < shape.at.length; i += 4) {
          LoopbenchPoses.placed(A, shape.at, i, null, p);
          LoopbenchPoses.placed(B, shape.at, i, null, q);
          most = Math.max(most, Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
        }
      }
      return most;
    }

    // The first time at which the two are seen apart, else that at which they are furthest.
    findParting() {
      const {first, second} = this, seen = 0.02 * this.scene.picture.extent;
      let best = 0, most = -1;
      for (const t of first.times) {
        if (t > second.times[second.times.length - 1]) break;
        const distance = this.apart(this.posesAt(first, t), this.posesAt(second, t));
        if (distance > most) [best, most] = [t, distance];
        if (distance > seen) break;
      }
      this.play(false);
      this.clock.set(best, this);
    }

    draw() {
      this.slider.value = String(this.clock.t);
      this.slider.setAttribute('aria-valuetext', number(this.clock.t) + ' s');
      if (!this.drawing || this.canvas.hidden) return;
      const {t} = this.clock, words = [];
      this.drawing.ghosts = [];
      if (this.first) {
        this.drawing.poses = this.posesAt(this.first, t);
        words.push(this.first.label + ' at ' + number(t) + ' s');
        const end = this.first.times[this.first.times.length - 1];
        if (t > end * (1 + 1e-9)) words.push('this motion ends at ' + number(end) + ' s');
      }
      if (this.second) {
        const poses = this.posesAt(this.second, t);
        this.drawing.ghosts = [{poses, colour: '--second'}];
        words.push('dashed: ' + this.second.label + ', ' + number(this.apart(this.drawing.poses, poses)) + ' m apart');
      }
      this.said.textContent = words.join('; ');
      this.drawing.draw();
    }

    // Once through all of it in eight seconds.
    play(on) {
      this.playing = on && this.first !== null;
      this.player.textContent = this.playing ? 'Pause' : 'Play';
      this.player.setAttribute('aria-pressed', String(this.playing));
      if (!this.playing) return;
      let last = performance.now();
      const frame = (now) => {
        if (!this.playing) return;
        const next = this.clock.t + this.clock.end * Math.min(0.1, (now - last) / 1000) / 8;
        last = now;
        this.clock.set(next >= this.clock.end ? 0 : next, this);
        requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }
  }
  return {Motion};
})();
