// A table of any length: only rows that are seen are elements. Sorted by headers, filtered by words and conditions.
'use strict';
const LoopbenchTable = (() => {
  const {make, button, check, command} = LoopbenchParts;
  const HIGH = 32, MOST_PRINTED = 300;  // of a row [px]; rows on paper
  const collator = new Intl.Collator('en', {numeric: true});

  // "rtol<=1e-6", "outcome=singular", "warnings~energy", or a word that any cell contains.
  function conditionOf(text, columns) {
    const match = /^([^=!<>~]+)(<=|>=|!=|=|<|>|~)(.*)$/.exec(text);
    const column = match && columns.find((one) => one.key === match[1]);
    if (!column) {
      const word = text.toLowerCase();
      const hits = columns.map((one) => one.words.map((cell) => cell.toLowerCase().includes(word)));
      return (row) => columns.some((one, c) => hits[c][one.at[row]]);
    }
    const [, , op, value] = match, wanted = Number(value);
    if (op === '~') return (row) => column.words[column.at[row]].includes(value);
    if (op === '=' || op === '!=') {
      const any = value.split(','), numbers = any.map(Number);
      const is = (row) => (column.numbers ? numbers.includes(column.numbers[row])
                                          : any.includes(column.words[column.at[row]].replace(/\?$/, '')));
      const raw = (row) => is(row) || any.includes(column.words[column.at[row]]);
      return op === '=' ? raw : (row) => !raw(row);
    }
    const values = column.numbers || [];
    const holds = {'<': (x) => x < wanted, '<=': (x) => x <= wanted, '>': (x) => x > wanted, '>=': (x) => x >= wanted}[op];
    return (row) => values[row] !== null && values[row] !== undefined && holds(values[row]);
  }

  class Table {
    // `on`: rows(list) whenever other rows are shown, pick(row)
    constructor(host, data, on = {}) {
      Object.assign(this, {data, on, chosen: -1, key: '', down: false, all: false, printing: false});
      this.count = data.ids.length;
      this.input = make('input', {type: 'search', size: '28', placeholder: 'words, rtol<=1e-6, outcome=finished',
                                  'aria-label': 'Filter of ' + data.title});
      this.input.addEventListener('input', () => this.filter());
      this.said = make('span', {role: 'status', 'aria-live': 'polite', class: 'soft'});
      const all = check('all columns', false, (on_) => { this.all = on_; this.drawHead(); this.draw(); });
      this.head = make('thead');
      this.body = make('tbody');
      this.grid = make('table', {'aria-rowcount': String(this.count + 1)}, this.head, this.body);
      this.grid.append(make('caption', {class: 'hidden'}, data.title));
      this.box = make('div', {class: 'rows', tabindex: '0', role: 'region', 'aria-label': data.title + '; arrow keys choose a row'},
                      this.grid);
      this.box.addEventListener('scroll', () => this.draw());
      this.box.addEventListener('keydown', (event) => this.press(event));
      this.detail = make('div', {class: 'detail', 'aria-live': 'polite'});
      const alike = data.alike.length ? [make('details', {}, make('summary', {}, 'the same in all rows: ' + data.alike.length +
          ' columns'), make('p', {class: 'soft'}, data.alike.join('; ')))] : [];
      host.append(make('h3', {}, data.title), make('div', {class: 'row'}, this.input, all.element, this.said),
                  this.box, this.detail, ...alike, command(data.command));
      this.drawHead();
      this.filter();
    }

    columns() { return this.data.columns.filter((one) => this.all || one.brief); }

    drawHead() {
      const cells = this.columns().map((column) => {
        const sorted = column.key === this.key ? (this.down ? 'descending' : 'ascending') : 'none';
        const mark = sorted === 'none' ? '' : this.down ? ' \u25bc' : ' \u25b2';
        // headers that paper repeats are words: buttons are left out there
        const cell = make('th', {scope: 'col', 'aria-sort': sorted}, this.printing ? column.header :
                          button(column.header + mark, () => this.sortBy(column.key), {title: column.key}));
        if (column.numbers) cell.className = 'number';
        return cell;
      });
      this.head.replaceChildren(make('tr', {'aria-rowindex': '1'}, ...cells));
    }

    // First ascending, then descending, then as the records were.
    sortBy(key) {
      if (this.key !== key) [this.key, this.down] = [key, false];
      else if (!this.down) this.down = true;
      else this.key = '';
      this.drawHead();
      this.filter();
    }

    filter(text) {
      if (text !== undefined) this.input.value = text;
      const words = this.input.value.split(/\s+/).filter((word) => word);
      const conditions = words.map((word) => conditionOf(word, this.data.columns));
      this.rows = [];
      for (let row = 0; row < this.count; ++row) if (conditions.every((holds) => holds(row))) this.rows.push(row);
      const column = this.data.columns.find((one) => one.key === this.key);
      if (column) {
        const sign = this.down ? -1 : 1;
        if (column.numbers) {
          const x = column.numbers;
          this.rows.sort((a, b) => (x[a] === null) - (x[b] === null) || sign * (x[a] - x[b]) || a - b);
        } else {
          const order = column.words.map((word, i) => i).sort((a, b) => collator.compare(column.words[a], column.words[b]));
          const rank = [];
          order.forEach((word, i) => { rank[word] = i; });
          this.rows.sort((a, b) => sign * (rank[column.at[a]] - rank[column.at[b]]) || a - b);
        }
      }
      this.said.textContent = this.rows.length + ' of ' + this.count + ' rows';
      this.box.scrollTop = 0;
      this.draw();
      if (this.on.rows) this.on.rows(this.rows);
    }

    draw() {
      const tall = this.box.clientHeight || 400;
      const first = this.printing ? 0 : Math.max(0, Math.floor(this.box.scrollTop / HIGH) - 5);
      const last = Math.min(this.rows.length, this.printing ? MOST_PRINTED : first + Math.ceil(tall / HIGH) + 10);
      const columns = this.columns(), list = [];
      const space = (rows) => make('tr', {'aria-hidden': 'true', class: 'space', style: 'height:' + rows * HIGH + 'px'});
      if (first > 0) list.push(space(first));
      for (let i = first; i < last; ++i) list.push(this.rowElement(this.rows[i], i, columns));
      if (!this.printing && last < this.rows.length) list.push(space(this.rows.length - last));
      this.body.replaceChildren(...list);
    }

    rowElement(row, place, columns) {
      const {failed, warnings} = this.data;
      const element = make('tr', {'aria-rowindex': String(place + 2), 'aria-selected': String(row === this.chosen),
                                  class: failed[row] ? 'bad' : warnings[row] ? 'flagged' : ''});
      for (const column of columns) {
        const cell = make('td', {}, column.words[column.at[row]]);
        if (column.numbers) cell.className = 'number';
        element.append(cell);
      }
      element.addEventListener('click', () => this.pick(row));
      return element;
    }

    press(event) {
      const place = this.rows.indexOf(this.chosen);
      const steps = {ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10, Home: -Infinity, End: Infinity}[event.key];
      if (steps === undefined || this.rows.length === 0 || event.target !== this.box) return;
      event.preventDefault();
      const next = Math.max(0, Math.min(this.rows.length - 1, place + steps));
      this.box.scrollTop = Math.max(0, next * HIGH - 0.4 * this.box.clientHeight);
      this.pick(this.rows[next]);
    }

    // Shows all columns of a row, its warnings in words, and the command that prints it.
    pick(row, tell = true) {
      this.chosen = row;
      this.draw();
      const {names, problems, warnings, failed, messages, ids} = this.data, all = LoopbenchParts.data('tables').warnings;
      const reasons = warnings[row].split(' ').filter((code) => code)
          .map((code) => make('li', {class: 'flagged'}, 'flagged, ' + code + ': ' + (all[code] || 'see the warnings above')));
      if (failed[row]) reasons.unshift(make('li', {class: 'bad'}, 'failed: ' + (messages[row] || 'without a message')));
      const list = make('dl', {});
      for (const column of this.data.columns) {
        const word = column.words[column.at[row]];
        if (word) list.append(make('div', {}, make('dt', {}, column.header),
                                   make('dd', {}, column.numbers && column.numbers[row] !== null
                                       ? String(column.numbers[row]) + (word.endsWith('?') ? ' ?' : '') : word)));
      }
      const shell = this.data.command.replace('--format csv', '--where case_id=' + ids[row] + ' --format json');
      this.detail.replaceChildren(make('h4', {}, problems[row] + ': ' + names[row]), make('ul', {}, ...reasons), list,
                                  command(shell));
      if (tell && this.on.pick) this.on.pick(row);
    }

    print(on) {
      this.printing = on;
      this.box.classList.toggle('paper', on);
      this.said.textContent = this.rows.length + ' of ' + this.count + ' rows' +
          (on && this.rows.length > MOST_PRINTED ? ', of which ' + MOST_PRINTED + ' on paper' : '');
      this.drawHead();
      this.draw();
    }
  }
  return {Table};
})();
