// The page of `loopbench view`: one mechanism, its motions, and lists of what it is made of.
'use strict';
(() => {
  const picture = JSON.parse(document.getElementById('picture').textContent);
  const byId = (id) => document.getElementById(id);
  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  };

  // Light or dark: as the system says until the reader says otherwise.
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  let theme = dark.matches ? 'dark' : 'light';
  const root = document.documentElement;
  root.dataset.theme = theme;

  const canvas = byId('canvas');
  const drawing = new LoopbenchScene.Drawing(canvas, picture);
  const tip = byId('tip'), said = byId('said'), play = byId('play'), slider = byId('frame');
  let chosen = -1, hovered = -1, playing = false, motion = null, phase = 0, last = 0, waiting = false;

  const redraw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame((now) => {
      waiting = false;
      advance(now);
      drawing.draw();
      if (playing) redraw();
    });
  };

  // A swing takes four seconds: sin(0) is the start.
  const PERIOD = 4;
  function frameOf(share) {
    const n = motion.frames.length - 1;
    if (!motion.returns) return share * n;
    const s = Math.sin(2 * Math.PI * share);
    return motion.start + s * (s > 0 ? n - motion.start : motion.start);
  }
  function showFrame(at) {
    drawing.poses = LoopbenchScene.between(picture, motion.frames, at);
    slider.value = String(at);
    slider.setAttribute('aria-valuetext', 'frame ' + at.toFixed(1) + ' of ' + (motion.frames.length - 1));
  }
  function advance(now) {
    if (!playing || !motion) return;
    phase += Math.min(0.1, (now - last) / 1000) / PERIOD;
    last = now;
    showFrame(frameOf(phase % 1));
  }
  function setPlaying(on) {
    playing = on && motion !== null;
    play.textContent = playing ? 'Pause' : 'Play';
    play.setAttribute('aria-pressed', String(playing));
    last = performance.now();
    redraw();
  }
  function showPaths() {
    const on = byId('paths').checked && motion !== null;
    drawing.traces = on ? [{paths: LoopbenchScene.paths(picture, motion.frames), colour: '--drive'}] : [];
  }
  function choose(index) {
    motion = picture.motions[index] || null;
    play.disabled = slider.disabled = motion === null;
    byId('motion').value = motion ? String(index) : 'start';
    byId('motiontext').textContent = motion ? motion.text : '';
    phase = 0;
    drawing.poses = picture.start;
    showPaths();
    if (motion) {
      slider.max = String(motion.frames.length - 1);
      showFrame(motion.start);
    }
    redraw();
  }

  // What is pointed at, or chosen in a list.
  function mark() {
    drawing.highlight = new Set(loopItems);
    if (chosen >= 0) drawing.highlight.add(chosen);
    if (hovered >= 0) drawing.highlight.add(hovered);
    redraw();
  }
  let loopItems = [];
  const words = (item) => [item.name, item.detail, item.gone, ...item.redundant.map((one) => 'redundant: ' + one)]
      .filter((word) => word).join('; ');
  function hover(item, x, y) {
    if (item !== hovered) {
      hovered = item;
      mark();
    }
    tip.hidden = item < 0;
    canvas.style.cursor = item < 0 ? 'grab' : 'pointer';
    if (item < 0) return;
    tip.textContent = words(picture.items[item]);
    tip.style.left = Math.min(x + 14, drawing.width - tip.offsetWidth - 4) + 'px';
    tip.style.top = Math.min(y + 14, drawing.height - tip.offsetHeight - 4) + 'px';
  }
  function pick(item) {
    chosen = chosen === item ? -1 : item;
    loopItems = [];
    for (const button of document.querySelectorAll('ul.items button')) {
      button.setAttribute('aria-pressed', String(Number(button.dataset.item) === chosen && chosen >= 0));
    }
    said.textContent = chosen >= 0 ? words(picture.items[chosen]) : '';
    mark();
  }

  // Lists beside the picture.
  const MOST_LISTED = 400;
  function list(title, entries, pressed) {
    if (entries.length === 0) return;
    const ul = make('ul', {class: 'items'});
    for (const entry of entries.slice(0, MOST_LISTED)) {
      const button = make('button', {type: 'button', 'aria-pressed': 'false', 'data-item': String(entry.item)},
                          make('span', entry.gone ? {class: 'gone'} : {}, entry.name), ' ',
                          make('small', {}, entry.text));
      button.addEventListener('click', () => pressed(entry, button));
      ul.append(make('li', {}, button));
    }
    if (entries.length > MOST_LISTED) ul.append(make('li', {}, 'and ' + (entries.length - MOST_LISTED) + ' more'));
    byId('lists').append(make('h2', {}, title + ' (' + entries.length + ')'), ul);
  }
  function itemsOf(kind) {
    const entries = [];
    picture.items.forEach((item, index) => {
      if (item.kind !== kind || index === 0) return;
      entries.push({item: index, name: item.name, gone: item.gone,
                    text: [item.detail, item.gone].filter((word) => word).join('; ')});
    });
    return entries;
  }
  const pickEntry = (entry) => pick(entry.item);
  const loops = picture.loops.map((loop) => {
    const cut = picture.items[picture.bodies + loop.joint];
    const redundant = loop.redundant.map((one) => 'redundant: ' + one);
    return {item: -1, loop, name: 'through ' + cut.name,
            text: [loop.gap > 1e-9 * picture.extent
                ? 'open by ' + LoopbenchScene.number(loop.gap) + ' m in the file'
                : 'closed in the file', ...redundant].join('; ')};
  });
  list('Loops', loops, (entry, button) => {
    const on = button.getAttribute('aria-pressed') !== 'true';
    pick(-1);
    button.setAttribute('aria-pressed', String(on));
    loopItems = on ? [...entry.loop.bodies, ...entry.loop.joints.map((j) => picture.bodies + j)] : [];
    said.textContent = on ? entry.name + ': ' + entry.text : '';
    mark();
  });
  list('Bodies', itemsOf('body'), pickEntry);
  list('Joints', itemsOf('joint'), pickEntry);
  list('Forces', itemsOf('force'), pickEntry);
  if (picture.notes.length > 0) {
    byId('lists').append(make('h2', {}, 'Omitted by runs, and not drawn'),
                         ...picture.notes.map((note) => make('p', {class: 'soft'}, note)));
  }

  // Controls.
  const select = byId('motion');
  select.append(make('option', {value: 'start'}, 'start'));
  picture.motions.forEach((one, i) => select.append(make('option', {value: String(i)}, one.name)));
  select.addEventListener('change', () => {
    choose(select.value === 'start' ? -1 : Number(select.value));
    setPlaying(motion !== null);
  });
  play.addEventListener('click', () => setPlaying(!playing));
  slider.addEventListener('input', () => {
    setPlaying(false);
    if (motion) showFrame(Number(slider.value));
    redraw();
  });
  byId('pathslabel').hidden = picture.points.length === 0 || picture.motions.length === 0;
  const toggles = {paths: showPaths, names: (on) => { drawing.names = on; }, centres: (on) => { drawing.centres = on; },
                   given: (on) => {
                     drawing.ghosts = on ? [{poses: picture.given}] : [];
                     drawing.gaps = on;
                   }};
  for (const [id, set] of Object.entries(toggles)) {
    byId(id).addEventListener('change', () => { set(byId(id).checked); redraw(); });
    set(byId(id).checked);
  }
  const setTheme = (name) => {
    theme = name;
    root.dataset.theme = name;
    byId('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
    redraw();
  };
  byId('theme').addEventListener('click', () => setTheme(theme === 'dark' ? 'light' : 'dark'));
  dark.addEventListener('change', () => setTheme(dark.matches ? 'dark' : 'light'));
  byId('fit').addEventListener('click', () => { drawing.fit(); redraw(); });

  LoopbenchScene.attach(drawing, {
    onHover: hover, onPick: pick, changed: redraw,
    onKey: (event) => {
      const n = picture.motions.length;
      if (event.key === ' ') setPlaying(!playing);
      else if (event.key === 'Escape') pick(-1);
      else if (event.key === 'n' && n > 0) choose((picture.motions.indexOf(motion) + 1) % n);
      else if (event.key === 'g') byId('given').click();
      else if (event.key === 't') byId('theme').click();
      else return false;
      return true;
    }});
  new ResizeObserver(() => { drawing.resize(); drawing.fit(); redraw(); }).observe(canvas);

  // Paper is white, and finer than a screen.
  let before = theme;
  window.addEventListener('beforeprint', () => {
    before = theme;
    root.dataset.theme = 'light';
    drawing.density = 3;
    drawing.resize();
    drawing.draw();
  });
  window.addEventListener('afterprint', () => {
    drawing.density = 0;
    drawing.resize();
    setTheme(before);
  });

  setTheme(theme);
  choose(picture.motions.length > 0 ? 0 : -1);
  setPlaying(!window.matchMedia('(prefers-reduced-motion: reduce)').matches);
  window.loopbenchView = {drawing, picture, state: () => ({playing, theme, chosen, hovered, phase})};
})();
