// The page of `loopbench report`: its parts, and what each tells the others.
'use strict';
(() => {
  const {make, select, data, command, Clock} = LoopbenchParts;
  const byId = (id) => document.getElementById(id);
  const root = document.documentElement;
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  let theme = dark.matches ? 'dark' : 'light';
  const clock = new Clock();
  const view = {clock, plots: [], tables: [], state: () => ({theme, t: clock.t})};
  window.loopbenchReport = view;

  const setTheme = (name) => {
    theme = root.dataset.theme = name;
    byId('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
    for (const plot of [...view.plots, view.costs]) if (plot && plot.u) plot.u.redraw(false);
    if (view.motion) view.motion.draw();
  };
  root.dataset.theme = theme;
  byId('theme').addEventListener('click', () => setTheme(theme === 'dark' ? 'light' : 'dark'));
  dark.addEventListener('change', () => setTheme(dark.matches ? 'dark' : 'light'));

  // Everything that draws comes after the words are on the screen.
  function build() {
    const {tables} = data('tables'), runs = tables.length && tables[0].kind === 'drift' ? tables[0] : null;
    if (runs) buildMotion(runs);
    else byId('motion').append(make('p', {}, 'The store has no accuracy runs: nothing over time.'));
    for (const table of tables) {
      const on = table === runs ? {rows: () => drawRows(), pick: (row) => pick(row)} : {};
      view.tables.push(new LoopbenchTable.Table(byId('tables'), table, on));
    }
    if (byId('costs') && data('costs').length) view.costs = new LoopbenchCosts.Costs(byId('costs'), data('costs'), pickId);
    if (byId('map') && data('map')) view.map = new LoopbenchMap.RobustnessMap(byId('map'), data('map'), pickId);
    for (const button of document.querySelectorAll('button.show')) {
      button.addEventListener('click', () => {
        view.tables[0].filter(button.dataset.filter);
        byId('tables').scrollIntoView();
      });
    }
    setTheme(theme);
    view.ready = true;
    drawRows();
  }

  function buildMotion(runs) {
    view.runs = runs;
    view.problems = data('problems');
    const host = byId('motion');
    view.choice = select('problem', view.problems.map((problem) => problem.name), (i) => showProblem(i));
    const grid = make('div', {class: 'together'}), left = make('div'), right = make('div');
    view.legend = make('p', {class: 'legend'});
    grid.append(left, right);
    host.append(make('div', {class: 'row'}, view.choice.element), view.legend, grid,
                make('p', {class: 'soft keys'}, 'Drag in a curve, or use its arrow keys: the time moves everywhere. Shift and drag to zoom, ' +
                    'Shift and wheel too, double click for the whole. Dashed: flagged or failed; a cross: the run failed there.'),
                command(data('plot-command')));
    view.motion = new LoopbenchMotion.Motion(left, clock);
    for (const plot of data('plots')) view.plots.push(new LoopbenchPlots.TimePlot(right, plot, runs, clock));
    view.problem = 0;
  }

  // Curves are of the rows that the table shows, of one problem.
  function rowsOfProblem() {
    const name = view.problems[view.problem].name;
    return (view.tables[0] ? view.tables[0].rows : []).filter((row) => view.runs.problems[row] === name);
  }
  function drawRows(chosen = -1) {
    if (!view.ready || !view.runs) return;
    const rows = rowsOfProblem();
    for (const plot of view.plots) plot.show(rows, chosen);
    const looks = data('tables').looks, kinds = new Map();
    for (const row of rows) {
      const name = view.runs.formulations[row] + (view.runs.absolute[row] ? ', absolute' : '');
      kinds.set(name, LoopbenchPlots.colourOf(looks, view.runs.formulations[row], view.runs.absolute[row]));
    }
    view.legend.replaceChildren(...[...kinds].map(([name, colour]) =>
      make('span', {}, make('span', {class: 'stroke', style: 'border-color:var(' + colour + ')'}), ' ' + name)));
    const ends = view.plots.map((plot) => plot.end());
    const paths = view.problems[view.problem].paths.map((path) => path.times[path.times.length - 1]);
    clock.end = Math.max(1e-12, ...ends, ...paths);
    if (view.shown !== view.problem) {
      view.shown = view.problem;
      view.motion.show(view.problems[view.problem]);
      clock.set(0);
    } else if (chosen < 0) {
      clock.set(clock.t);
    }
  }
  function showProblem(i) {
    view.problem = i;
    view.choice.list.value = String(i);
    drawRows();
  }
  function pick(row) {
    const i = view.problems.findIndex((problem) => problem.name === view.runs.problems[row]);
    if (i >= 0) view.problem = i;
    view.choice.list.value = String(view.problem);
    drawRows(row);
    view.motion.choose(row);
  }
  function pickId(id, scroll = false) {
    const row = view.runs ? view.runs.ids.indexOf(id) : -1;
    if (row < 0) return;
    if (!view.tables[0].rows.includes(row)) view.tables[0].filter('');
    view.tables[0].pick(row);
    if (scroll) view.tables[0].detail.scrollIntoView({block: 'center'});
  }

  window.addEventListener('keydown', (event) => {
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
    if (event.key === 't' && !typing && !event.ctrlKey && !event.metaKey) byId('theme').click();
  });
  let before = theme;
  window.addEventListener('beforeprint', () => {
    before = theme;
    setTheme('light');
    for (const table of view.tables) table.print(true);
  });
  window.addEventListener('afterprint', () => {
    for (const table of view.tables) table.print(false);
    setTheme(before);
  });
  setTheme(theme);
  requestAnimationFrame(() => setTimeout(build, 0));
})();
