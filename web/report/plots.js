// Curves against time, drawn by uPlot: linear and logarithmic axes, zoom, what is under the pointer, and the time.
'use strict';
const LoopbenchPlots = (() => {
  const {make, button, check, number, styleOf} = LoopbenchParts;
  const MOST_CURVES = 40;

  // The name of a run's colour: that of its formulation, strong in joint coordinates, weak in absolute ones.
  function colourOf(looks, formulation, absolute) {
    const look = looks[formulation];
    return look ? look[absolute ? 1 : 0] : '--soft';
  }

  // Of logarithmic axes over more than four decades lines are at the decades alone, and words at every few of them.
  const isDecade = (value) => Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-6;
  const spanOf = (splits) => Math.log10(splits[splits.length - 1] / splits[0]);
  const decades = (u, splits) => (spanOf(splits) > 4 ? splits.map((value) => (isDecade(value) ? value : null)) : splits);
  // Fewer than three decades have words at 1, 2 and 5 too.
  const everyFew = (u, splits) => {
    const step = Math.ceil(spanOf(splits) / 7);
    const only = (is) => splits.map((value) => (is(value) ? value : null)), count = (list) => list.filter((value) => value !== null).length;
    const some = only((value) => isDecade(value) && Math.round(Math.log10(value)) % step === 0);
    const more = only((value) => [1, 2, 5].some((digit) => isDecade(value / digit)));
    return count(some) > 2 ? some : count(more) > 2 ? more : splits;
  };
  // uPlot's axes in the colours of the page.
  const axis = (label, log, more) => ({
    label, stroke: () => styleOf('--text'), grid: {stroke: () => styleOf('--rule'), width: 1, ...(log ? {filter: decades} : {})},
    ticks: {stroke: () => styleOf('--rule'), ...(log ? {filter: decades} : {})}, ...(log ? {filter: everyFew} : {}),
    values: short, font: '12px system-ui, sans-serif', labelFont: '13px system-ui, sans-serif',
    ...more});
  const short = (u, values) => values.map((value) => {
    if (value === null) return '';
    const size = Math.abs(value);
    return value !== 0 && (size < 1e-3 || size >= 1e5) ? Number(value.toPrecision(4)).toExponential() : String(Number(value.toPrecision(6)));
  });

  // Drag moves the time (or calls `at`); with Shift it zooms, and so does the wheel.
  function attach(plot, u, at) {
    const over = u.over;
    let from = null;
    const place = (event) => {
      const box = over.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    over.style.touchAction = 'pan-y';
    over.addEventListener('pointerdown', (event) => {
      over.setPointerCapture(event.pointerId);
      from = {at: place(event), zooms: event.shiftKey};
      if (!from.zooms) at(u.posToVal(from.at[0], 'x'));
    });
    over.addEventListener('pointermove', (event) => {
      const [x, y] = place(event);
      if (from && from.zooms) {
        u.setSelect({left: Math.min(x, from.at[0]), top: Math.min(y, from.at[1]), width: Math.abs(x - from.at[0]),
                     height: Math.abs(y - from.at[1])}, false);
      } else if (from) {
        at(u.posToVal(x, 'x'));
      }
    });
    const ended = (event) => {
      const [x, y] = place(event);
      if (from && from.zooms && Math.abs(x - from.at[0]) > 4 && Math.abs(y - from.at[1]) > 4) {
        const range = (a, b, scale) => ({min: Math.min(u.posToVal(a, scale), u.posToVal(b, scale)),
                                         max: Math.max(u.posToVal(a, scale), u.posToVal(b, scale))});
        plot.zoom(range(from.at[0], x, 'x'), range(from.at[1], y, 'y'));
      }
      u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
      from = null;
    };
    over.addEventListener('pointerup', ended);
    over.addEventListener('pointercancel', () => { from = null; });
    over.addEventListener('dblclick', () => plot.whole());
    over.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;  // the wheel alone scrolls the page
      event.preventDefault();
      const [x, y] = place(event);
      plot.scaleBy(Math.exp(0.0015 * (event.deltaY || event.deltaX)), x, y);
    }, {passive: false});
  }

  // Limits and zoom, the same for curves and for points.
  class Zoomable {
    zoom(x, y) {
      this.range = {x: [x.min, x.max], y: [y.min, y.max]};
      this.u.batch(() => { this.u.setScale('x', x); this.u.setScale('y', y); });
    }
    whole() {
      this.range = null;
      this.rebuild();
    }
    scaleBy(factor, px, py) {
      const u = this.u, next = {};
      if (!u) return;  // nothing to draw, nothing to zoom
      const w = u.over.clientWidth, h = u.over.clientHeight;
      for (const [scale, size, p] of [['x', w, px === undefined ? w / 2 : px], ['y', h, py === undefined ? h / 2 : py]]) {
        const ends = [u.posToVal(p - factor * p, scale), u.posToVal(p + factor * (size - p), scale)].sort((a, b) => a - b);
        next[scale] = {min: ends[0], max: ends[1]};
      }
      this.zoom(next.x, next.y);
    }
    buttons() {
      return [button('+', () => this.scaleBy(0.6), {'aria-label': 'Zoom in'}),
              button('\u2212', () => this.scaleBy(1 / 0.6), {'aria-label': 'Zoom out'}),
              button('Whole', () => this.whole())];
    }
    size() { return {width: Math.max(200, this.stage.clientWidth), height: this.tall || 280}; }
  }

  class TimePlot extends Zoomable {
    // `table` has names and formulations of the rows that curves belong to
    constructor(host, plot, table, clock) {
      super();
      Object.assign(this, {plot, table, clock, rows: [], chosen: -1, hovered: -1, range: null, logX: false, logY: true});
      const log = (name, label) => check(label, this[name], (on) => { this[name] = on; this.range = null; this.rebuild(); });
      const y = log('logY', 'log y: ' + plot.name), x = log('logX', 'log x: time');
      this.boxes = {x: x.box, y: y.box};
      this.stage = make('div', {class: 'plot', tabindex: '0', role: 'img'});
      this.stage.addEventListener('keydown', (event) => this.press(event));
      this.tip = make('div', {class: 'tip', hidden: ''});
      this.said = make('p', {class: 'soft'});
      host.append(make('figure', {}, make('figcaption', {}, make('b', {}, plot.title + ' [' + plot.unit + ']')),
                       make('div', {class: 'row'}, y.element, x.element, ...this.buttons()),
                       make('div', {class: 'stage'}, this.stage, this.tip), this.said));
      clock.listen(() => this.drawTime());
      new ResizeObserver(() => this.u && this.u.setSize(this.size())).observe(this.stage);
    }

    curves() {
      if (!this.byRow) {
        this.byRow = new Map(LoopbenchParts.data('curves-' + this.plot.name).map((curve) => [curve.row, curve]));
      }
      return this.byRow;
    }

    // Curves of these rows.
    show(rows, chosen = -1) {
      this.there = rows.filter((row) => this.curves().has(row));
      const few = Math.min(1, MOST_CURVES / this.there.length);  // of many, those that lie evenly in the table
      this.rows = this.there.filter((row, i) => Math.floor((i + 1) * few) > Math.floor(i * few));
      if (chosen >= 0 && this.there.includes(chosen) && !this.rows.includes(chosen)) this.rows.push(chosen);
      this.chosen = chosen;
      this.range = null;
      this.rebuild();
    }

    // NaN and, on a logarithmic axis, what is not positive are no points. Energy errors have a sign.
    points(row) {
      const curve = this.curves().get(row), t = [], y = [];
      for (let i = 0; i < curve.t.length; ++i) {
        const value = this.logY && curve.y[i] !== null ? Math.abs(curve.y[i]) : curve.y[i];
        if ((this.logX && !(curve.t[i] > 0)) || (this.logY && value !== null && !(value > 0))) continue;
        if (t.length > 0 && !(curve.t[i] > t[t.length - 1])) continue;
        t.push(curve.t[i]);
        y.push(value);
      }
      return [t, y];
    }

    end() {
      let end = 0;
      for (const row of this.rows) {
        const {t} = this.curves().get(row);
        end = Math.max(end, t[t.length - 1]);
      }
      return end;
    }

    rebuild() {
      if (this.u) this.u.destroy();
      this.u = null;
      this.stage.replaceChildren();
      const looks = LoopbenchParts.data('tables').looks, {table} = this;
      const lists = this.rows.map((row) => this.points(row));
      this.said.textContent = this.there.length === 0 ? 'No run shown has this quantity.' :
          this.rows.length + ' of ' + this.there.length + ' runs drawn' +
          (this.rows.length < this.there.length ? ', evenly chosen from the table; its filter chooses others' : '') +
          (this.logY && this.plot.name === 'energy' ? '; sizes without their sign' : '');
      this.stage.setAttribute('aria-label', this.plot.title + ' of ' + this.rows.length +
                              ' runs against time; arrow keys move the time');
      if (!lists.some(([t]) => t.length > 0)) {
        this.stage.append(make('p', {class: 'soft'}, this.there.length ? 'Nothing positive to draw on this axis.' : ''));
        return;
      }
      const series = this.rows.map((row) => ({
        label: table.names[row], stroke: () => styleOf(colourOf(looks, table.formulations[row], table.absolute[row])), width: 1.8, spanGaps: false, points: {show: false},
        dash: table.warnings[row] || table.failed[row] ? [6, 4] : undefined,
        alpha: 1}));
      this.u = new uPlot({
        ...this.size(), legend: {show: false}, padding: [8, 12, 0, 0],
        cursor: {drag: {x: false, y: false}, focus: {prox: 24}, points: {size: 7}},
        focus: {alpha: 0.35},
        scales: {x: {time: false, distr: this.logX ? 3 : 1}, y: {distr: this.logY ? 3 : 1}},
        axes: [axis('time [s]', this.logX, {}), axis(this.plot.title + ' [' + this.plot.unit + ']', this.logY, {size: 72})],
        series: [{}, ...series],
        hooks: {setCursor: [() => this.hover()], setSeries: [(u, index) => { this.hovered = index === null ? -1 : index - 1; }],
                draw: [() => this.drawTime()], drawSeries: [(u, index) => this.drawEnd(u, index)]}},
      uPlot.join(lists), this.stage);
      if (this.range) this.zoom({min: this.range.x[0], max: this.range.x[1]}, {min: this.range.y[0], max: this.range.y[1]});
      this.line = make('div', {class: 'time'});
      this.u.over.append(this.line);
      attach(this, this.u, (t) => this.clock.set(t, this));
      if (this.chosen >= 0) this.u.setSeries(this.rows.indexOf(this.chosen) + 1, {focus: true}, false);
      this.drawTime();
    }

    // A cross where a run failed.
    drawEnd(u, index) {
      const row = this.rows[index - 1];
      if (row === undefined || !this.table.failed[row]) return;
      const [t, y] = this.points(row);
      if (t.length === 0) return;
      const x = u.valToPos(t[t.length - 1], 'x', true), v = u.valToPos(y[t.length - 1], 'y', true), s = 5 * devicePixelRatio;
      u.ctx.save();
      u.ctx.strokeStyle = styleOf('--gap');
      u.ctx.lineWidth = 2 * devicePixelRatio;
      u.ctx.beginPath();
      u.ctx.moveTo(x - s, v - s); u.ctx.lineTo(x + s, v + s);
      u.ctx.moveTo(x + s, v - s); u.ctx.lineTo(x - s, v + s);
      u.ctx.stroke();
      u.ctx.restore();
    }

    drawTime() {
      if (!this.u || !this.line) return;
      const x = this.logX && !(this.clock.t > 0) ? 0 : this.u.valToPos(this.clock.t, 'x');
      this.line.style.left = x + 'px';
      this.line.hidden = !(x >= 0 && x <= this.u.over.clientWidth);
    }

    hover() {
      const {u} = this, row = this.rows[this.hovered], index = u.cursor.idxs ? u.cursor.idxs[this.hovered + 1] : null;
      this.tip.hidden = row === undefined || index === null || index === undefined || u.cursor.left < 0;
      if (this.tip.hidden) return;
      const {names, warnings, failed} = this.table;
      this.tip.textContent = names[row] + ': ' + number(u.data[this.hovered + 1][index]) + ' ' + this.plot.unit + ' at ' +
          number(u.data[0][index]) + ' s' + (failed[row] ? ' (failed)' : warnings[row] ? ' (flagged: ' + warnings[row] + ')' : '');
      this.tip.style.left = Math.min(u.cursor.left + 90, this.stage.clientWidth - this.tip.offsetWidth - 4) + 'px';
      this.tip.style.top = Math.max(0, u.cursor.top - 26) + 'px';
    }

    press(event) {
      const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (step) this.clock.set(this.clock.t + step * this.clock.end / 100, this);
      else if (event.key === '+') this.scaleBy(0.6);
      else if (event.key === '-') this.scaleBy(1 / 0.6);
      else if (event.key === '0') this.whole();
      else return;
      event.preventDefault();
    }
  }
  return {TimePlot, Zoomable, axis, attach, colourOf};
})();
