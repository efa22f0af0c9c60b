// What all parts of a report share: elements, data, the time that they show.
'use strict';
const LoopbenchParts = (() => {
  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  };
  const button = (text, pressed, attributes = {}) => {
    const element = make('button', {type: 'button', ...attributes}, text);
    element.addEventListener('click', () => pressed(element));
    return element;
  };
  const select = (label, options, chosen) => {
    const list = make('select', {}, ...options.map((text, i) => make('option', {value: String(i)}, text)));
    list.addEventListener('change', () => chosen(Number(list.value)));
    return {list, element: make('label', {}, label + ' ', list)};
  };
  const check = (label, on, changed) => {
    const box = make('input', {type: 'checkbox'});
    box.checked = on;
    box.addEventListener('change', () => changed(box.checked));
    return {box, element: make('label', {}, box, ' ' + label)};
  };
  const command = (text) => make('p', {class: 'command'}, make('code', {}, text));

  // An element's data, parsed when it is asked for: pages with 10^6 points are shown before that.
  const known = new Map();
  function data(id) {
    if (!known.has(id)) {
      const element = document.getElementById('data-' + id);
      known.set(id, element ? JSON.parse(element.textContent) : null);
    }
    return known.get(id);
  }

  const number = (value) => (value === null || value === undefined ? '' : String(Number(Number(value).toPrecision(4))));
  const styleOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim() || '#888';

  // The time that every plot and the linkage show.
  class Clock {
    constructor() {
      this.t = 0;
      this.end = 1;
      this.listeners = [];
    }
    set(t, from) {
      this.t = Math.max(0, Math.min(this.end, t));
      for (const listener of this.listeners) listener(this.t, from);
    }
    listen(listener) { this.listeners.push(listener); }
  }

  return {make, button, select, check, command, data, number, styleOf, Clock};
})();
