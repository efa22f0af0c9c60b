// The failure map: extremes by methods, each foldable; a cell that is chosen says why it is as it is.
'use strict';
const LoopbenchMap = (() => {
  const {make, button, command} = LoopbenchParts;

  class RobustnessMap {
    constructor(host, map, pick) {
      Object.assign(this, {map, pick, folded: new Set(), narrow: new Set(), chosen: null});
      this.legend = make('p', {class: 'legend'});
      for (const state of map.states) {
        const count = this.count(() => true, () => true)[state] || 0;
        this.legend.append(make('span', {}, make('span', {class: 'square', 'data-state': state}), ' ' + state + ': ' + count));
      }
      this.grid = make('table', {class: 'map'});
      this.said = make('div', {class: 'detail', role: 'status', 'aria-live': 'polite'});
      const every = (text, on) => button(text, () => {
        this.folded = new Set(on ? map.groups.map((one, g) => g) : []);
        this.narrow = new Set();
        this.draw();
      });
      host.append(...(map.comment ? [make('p', {class: 'soft'}, map.comment)] : []), this.legend,
                  make('div', {class: 'row'}, every('Fold all extremes', true), every('Unfold all', false)),
                  make('div', {class: 'wide', tabindex: '0', role: 'region', 'aria-label': 'Failure map'}, this.grid),
                  this.said, ...(map.remarks.length ? [make('ul', {}, ...map.remarks.map((one) => make('li', {}, one)))] : []),
                  command(map.command));
      this.draw();
    }

    count(ofGroup, ofColumn) {
      const counts = {};
      this.map.groups.forEach((group, g) => {
        if (!ofGroup(g)) return;
        for (const row of group.rows) {
          row.cells.forEach((cell, c) => {
            if (ofColumn(c)) counts[cell.state] = (counts[cell.state] || 0) + 1;
          });
        }
      });
      return counts;
    }

    // Of a folded group or method: how many cells of each state, as words and as a bar.
    summary(counts, tag = 'td') {
      const words = this.map.states.filter((state) => counts[state]).map((state) => counts[state] + ' ' + state).join(', ');
      const bar = make('span', {class: 'share', 'aria-hidden': 'true'});
      for (const state of this.map.states) {
        if (counts[state]) bar.append(make('span', {'data-state': state, style: 'flex:' + counts[state]}));
      }
      return make(tag, {title: words}, bar, make('span', {class: 'hidden'}, words));
    }

    draw() {
      const {map} = this, rows = [];
      const toggle = (set, what) => { if (!set.delete(what)) set.add(what); this.draw(); };
      rows.push(make('tr', {}, make('th', {scope: 'col'}, 'extreme'), ...map.columns.map((label, c) =>
        make('th', {scope: 'col', class: this.narrow.has(c) ? 'narrow' : ''},
             button(this.narrow.has(c) ? '+' : label, () => toggle(this.narrow, c),
                    {'aria-expanded': String(!this.narrow.has(c)), 'aria-label': 'method ' + label, title: label})))));
      map.groups.forEach((group, g) => {
        const folded = this.folded.has(g);
        rows.push(make('tr', {class: 'group'},
                       make('th', {scope: 'row'}, button((folded ? '\u25b8 ' : '\u25be ') + group.label, () => toggle(this.folded, g),
                                                         {'aria-expanded': String(!folded)})),
                       ...map.columns.map((label, c) => this.summary(this.count((k) => k === g, (k) => k === c)))));
        if (folded) return;
        group.rows.forEach((row, r) => rows.push(make('tr', {}, make('th', {scope: 'row'}, row.label),
            ...row.cells.map((cell, c) => this.cell(group, row, cell, c)))));
      });
      this.grid.replaceChildren(make('tbody', {}, ...rows));
    }

    cell(group, row, cell, c) {
      const words = cell.text + (cell.number ? ' ' + cell.number : '') + (cell.count ? ' ' + cell.count : '');
      const short = this.narrow.has(c) ? '' : words;
      const element = button(short, () => {
        this.chosen = cell;
        for (const other of this.grid.querySelectorAll('[aria-pressed=true]')) other.setAttribute('aria-pressed', 'false');
        element.setAttribute('aria-pressed', 'true');
        this.explain(group, row, cell, c);
      }, {'data-state': cell.state, 'aria-pressed': String(cell === this.chosen),
          'aria-label': row.label + ', ' + this.map.columns[c] + ': ' + words});
      return make('td', {}, element);
    }

    explain(group, row, cell, c) {
      const lines = [
        ['deciding value', cell.reason || cell.limit || (cell.state === 'holds' ? 'all measures as demanded' : '')],
        ['number', cell.number],
        ['runs', cell.holding + ' of ' + cell.records + ' hold' + (cell.records < cell.cases ? ', ' + cell.cases + ' expected' : '')],
        ['demanded of every run', row.demands.join('; ')],
        ['why these limits', row.why],
        ['the gate asks for it', cell.demanded ? 'yes' : 'no'],
        ['runs that count', row.select]];
      const list = make('dl', {}, ...lines.filter(([, text]) => text).map(([name, text]) =>
        make('div', {}, make('dt', {}, name), make('dd', {}, text))));
      const show = cell.id ? [button('Show the run that decided', () => this.pick(cell.id, true))] : [];
      this.said.replaceChildren(make('h4', {}, make('span', {class: 'square', 'data-state': cell.state}), ' ' + group.label + ', ' + row.label +
          ': ' + this.map.columns[c] + ': ' + cell.text), list, ...show);
    }
  }
  return {RobustnessMap};
})();
