// Error over cost, one point a run, with the Pareto front as the judge of `loopbench tradeoff` has it.
'use strict';
const LoopbenchCosts = (() => {
  const {make, button, select, check, command, number, styleOf} = LoopbenchParts;
  const {Zoomable, axis} = LoopbenchPlots;

  class Costs extends Zoomable {
    // `pick(id)` of a point that is chosen
    constructor(host, costs, pick) {
      super();
      Object.assign(this, {costs, pick, cost: costs[0], problem: costs[0].problems[0], tall: 380, logX: true, logY: true});
      const names = select('problem', this.cost.problems.map((one) => one.name), (i) => this.show(this.cost, i));
      const errors = select('error', costs.map((one) => one.error), (i) => {
        names.list.replaceChildren(...costs[i].problems.map((one, k) => make('option', {value: String(k)}, one.name)));
        this.show(costs[i], 0);
      });
      const x = check('log cost', true, (on) => { this.logX = on; this.rebuild(); });
      const y = check('log error', true, (on) => { this.logY = on; this.rebuild(); });
      this.stage = make('div', {class: 'plot', role: 'img', tabindex: '0'});
      this.stage.addEventListener('keydown', (event) => this.press(event));
      this.tip = make('div', {class: 'tip', hidden: ''});
      this.legend = make('p', {class: 'legend'});
      this.said = make('p', {role: 'status', 'aria-live': 'polite'});
      this.more = make('div');
      host.append(make('div', {class: 'row'}, errors.element, names.element, x.element, y.element, ...this.buttons()),
                  make('div', {class: 'stage'}, this.stage, this.tip), this.legend, this.said, this.more);
      new ResizeObserver(() => this.u && this.u.setSize(this.size())).observe(this.stage);
      this.show(this.cost, 0);
    }

    show(cost, i) {
      this.cost = cost;
      this.problem = cost.problems[i];
      this.chosen = -1;
      const front = this.problem.rows.filter((row) => row.front);
      const out = this.problem.rows.filter((row) => row.reason);
      const line = (row) => make('li', {}, button(row.name, () => this.choose(this.problem.rows.indexOf(row)), {class: 'link'}),
                                 ' ' + number(row.y) + (row.bound ? ' (a bound)' : '') + ' for ' + number(row.x),
                                 row.reason ? make('span', {class: 'soft'}, ': ' + row.reason) : '');
      this.more.replaceChildren(
          make('h3', {}, 'On the front: ' + cost.error + ' for ' + cost.cost), make('ul', {}, ...front.map(line)),
          ...(out.length ? [make('details', {}, make('summary', {}, 'Not compared: ' + out.length + ' of ' +
              this.problem.rows.length + ' runs'), make('ul', {}, ...out.slice(0, 200).map(line)))] : []),
          make('details', {}, make('summary', {}, 'What was equal among the compared runs, and what was not'),
               make('ul', {}, ...[...cost.remarks, ...cost.fairness].map((text) => make('li', {}, text)))),
          command(cost.command));
      this.said.textContent = '';
      this.rebuild();
    }

    rebuild() {
      if (this.u) this.u.destroy();
      this.stage.replaceChildren();
      this.u = null;
      const drawable = (row) => row.x !== null && row.y !== null && (!this.logX || row.x > 0) && (!this.logY || row.y > 0);
      this.rows = this.problem.rows.filter(drawable).sort((a, b) => a.x - b.x);
      const left = this.problem.rows.length - this.rows.length;
      this.stage.setAttribute('aria-label', this.cost.error + ' over ' + this.cost.cost + ': ' + this.rows.length +
                              ' runs; the list below has those on the front');
      if (this.rows.length === 0) {
        this.stage.append(make('p', {class: 'soft'}, 'No run has both numbers.'));
        return;
      }
      // runs of equal cost would share a place: each has a column of its own
      const x = this.rows.map((row, i) => row.x * (1 + 1e-12 * i));
      const looks = LoopbenchParts.data('tables').looks;
      const kinds = new Map();
      for (const row of this.rows) {
        const name = row.formulation + (row.absolute ? ', absolute' : '') + (row.reason ? ', not compared' : '');
        const colour = LoopbenchPlots.colourOf(looks, row.formulation, row.absolute);
        if (!kinds.has(name)) kinds.set(name, {name, colour, out: !!row.reason, of: new Set()});
        kinds.get(name).of.add(row);
      }
      const list = [...kinds.values()];
      const front = this.rows.map((row) => (row.front ? row.y : undefined));
      this.u = new uPlot({
        ...this.size(), legend: {show: false}, padding: [8, 16, 0, 0],
        cursor: {drag: {x: false, y: false}, x: false, y: false, points: {show: false}},
        scales: {x: {time: false, distr: this.logX ? 3 : 1}, y: {distr: this.logY ? 3 : 1}},
        axes: [axis(this.cost.cost, this.logX, {}), axis(this.cost.error, this.logY, {size: 72})],
        series: [{}, {label: 'front', stroke: () => styleOf('--text'), width: 1.5, spanGaps: true, points: {show: false},
                      paths: uPlot.paths.stepped({align: 1})},
                 ...list.map((kind) => ({label: kind.name, stroke: () => styleOf(kind.colour), width: 0, paths: () => null,
                                         points: {show: true, size: 9, width: 2, fill: () => (kind.out ? 'transparent' : styleOf(kind.colour))}}))],
        hooks: {setCursor: [() => this.hover()], draw: [() => this.drawChosen()]}},
      [x, front, ...list.map((kind) => this.rows.map((row) => (kind.of.has(row) ? row.y : undefined)))], this.stage);
      LoopbenchPlots.attach(this, this.u, () => this.choose(this.near < 0 ? -1 : this.problem.rows.indexOf(this.rows[this.near])));
      this.legend.replaceChildren(...list.map((kind) => make('span', {}, make('span', {class: kind.out ? 'ring' : 'dot',
          style: 'border-color:var(' + kind.colour + ')' + (kind.out ? '' : ';background:var(' + kind.colour + ')')}), ' ' + kind.name)),
          make('span', {}, make('span', {class: 'stroke'}), ' Pareto front'),
          ...(left ? [make('span', {class: 'soft'}, left + ' runs have no place on these axes')] : []));
    }

    hover() {
      const {u} = this;
      this.near = -1;
      let best = 18;
      if (u.cursor.left >= 0) {
        this.rows.forEach((row, i) => {
          const distance = Math.hypot(u.valToPos(row.x, 'x') - u.cursor.left, u.valToPos(row.y, 'y') - u.cursor.top);
          if (distance < best) [best, this.near] = [distance, i];
        });
      }
      this.tip.hidden = this.near < 0;
      if (this.near < 0) return;
      this.tip.textContent = this.words(this.rows[this.near]);
      this.tip.style.left = Math.min(u.cursor.left + 90, this.stage.clientWidth - this.tip.offsetWidth - 4) + 'px';
      this.tip.style.top = Math.max(0, u.cursor.top - 30) + 'px';
    }

    words(row) {
      return row.name + ': ' + this.cost.error + ' ' + number(row.y) + (row.bound ? ' (a bound)' : '') + ', ' + this.cost.cost + ' ' +
          number(row.x) + (row.front ? '; on the front' : '') + (row.reason ? '; not compared: ' + row.reason : '');
    }

    choose(i) {
      this.chosen = i;
      const row = this.problem.rows[i];
      this.said.textContent = row ? this.words(row) : '';
      if (this.u) this.u.redraw(false);
      if (row) this.pick(row.id);
    }

    drawChosen() {
      const row = this.problem.rows[this.chosen], {u} = this;
      if (!row || row.x === null || row.y === null) return;
      u.ctx.save();
      u.ctx.strokeStyle = styleOf('--mark');
      u.ctx.lineWidth = 2.5 * devicePixelRatio;
      u.ctx.beginPath();
      u.ctx.arc(u.valToPos(row.x, 'x', true), u.valToPos(row.y, 'y', true), 9 * devicePixelRatio, 0, 2 * Math.PI);
      u.ctx.stroke();
      u.ctx.restore();
    }

    press(event) {
      const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
      if (step) {
        const order = this.rows.map((row) => this.problem.rows.indexOf(row));
        this.choose(order[Math.max(0, Math.min(order.length - 1, order.indexOf(this.chosen) + step))]);
      } else if (event.key === '+') this.scaleBy(0.6);
      else if (event.key === '-') this.scaleBy(1 / 0.6);
      else if (event.key === '0') this.whole();
      else return;
      event.preventDefault();
    }
  }
  return {Costs};
})();
