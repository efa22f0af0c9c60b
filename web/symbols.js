// How shapes are painted: lines, bars, discs, springs, dashpots, arrows.
'use strict';
const LoopbenchSymbols = (() => {
  const TURN = 2 * Math.PI;
  const FILLED = {body: '--body', ground: '--ground', joint: '--joint', solid: '--solid', guide: '--guide',
                  rod: '--joint', centre: '--joint', force: '--force', drive: '--drive'};
  const STROKED = {body: '--line', ground: '--soft', joint: '--line', solid: '--line', guide: '--soft',
                   rod: '--line', centre: '--soft', spring: '--spring', damper: '--damper',
                   force: '--force', drive: '--drive'};
  const WIDTH = {joint: 1.4, spring: 1.5, damper: 1.5, force: 1.8, drive: 2};

  // One shape of Drawing.project() on its canvas.
  function paint(drawing, {shape, spots, radius, gone, size}) {
    const g = drawing.context, marked = drawing.highlight.has(shape.item);
    const stroke = drawing.colour(marked ? '--mark' : gone ? '--gone' : STROKED[shape.style]);
    const fill = drawing.colour(gone ? '--gonefill' : FILLED[shape.style] || '--joint');
    const width = (WIDTH[shape.style] || 1.1) + (marked ? 1.4 : 0);
    g.lineJoin = g.lineCap = 'round';
    g.setLineDash(gone && size > 12 ? [4, 3] : []);
    const trace = (points, closed) => {
      g.beginPath();
      points.forEach((s, i) => (i ? g.lineTo(s[0], s[1]) : g.moveTo(s[0], s[1])));
      if (closed) g.closePath();
    };
    const line = (points, closed) => {
      trace(points, closed);
      g.strokeStyle = stroke;
      g.lineWidth = width;
      g.stroke();
    };
    const aside = shape.aside * drawing.scale;
    switch (shape.kind) {
      case 'line': line(spots); break;
      case 'bar':
      case 'area': {
        const closed = shape.kind === 'area';
        trace(spots, closed);
        if (radius > 0.8) {
          g.setLineDash([]);
          g.strokeStyle = stroke;
          g.lineWidth = 2 * radius + width;
          g.stroke();
          g.strokeStyle = g.fillStyle = fill;
          g.lineWidth = Math.max(0.5, 2 * radius - width);
          g.stroke();
          if (closed) g.fill();
        } else {
          g.fillStyle = fill;
          // what is behind a plate in space shows through
          g.globalAlpha = closed && shape.style === 'body' && !drawing.picture.planar ? 0.8 : 1;
          if (closed) g.fill();
          g.globalAlpha = 1;
          g.strokeStyle = stroke;
          g.lineWidth = width;
          g.stroke();
        }
        break;
      }
      case 'disc':
      case 'centre':
        g.beginPath();
        g.arc(spots[0][0], spots[0][1], Math.max(0.5, radius), 0, TURN);
        g.fillStyle = fill;
        g.fill();
        g.strokeStyle = stroke;
        g.lineWidth = width;
        g.stroke();
        if (shape.kind === 'centre') {
          g.fillStyle = drawing.colour('--line');
          for (const from of [-0.25, 0.25]) {
            g.beginPath();
            g.moveTo(spots[0][0], spots[0][1]);
            g.arc(spots[0][0], spots[0][1], radius, from * TURN, (from + 0.25) * TURN);
            g.fill();
          }
        }
        break;
      case 'spring': line(spring(spots[0], spots[1], radius, aside)); break;
      case 'damper': for (const part of damper(spots[0], spots[1], radius, aside)) line(part); break;
      case 'arrow': {
        g.setLineDash(shape.style === 'drive' ? [5, 3] : []);
        line(spots);
        g.setLineDash([]);
        const tip = spots[spots.length - 1], way = along(spots[spots.length - 2], tip);
        const head = Math.max(6, 1.3 * drawing.picture.symbol * drawing.scale);
        trace([tip, way.at(way.length - head, 0.45 * head), way.at(way.length - head, -0.45 * head)], true);
        g.fillStyle = stroke;
        g.fill();
        break;
      }
    }
    g.setLineDash([]);
  }

  function fromSegment(x, y, a, b) {
    const dx = b[0] - a[0], dy = b[1] - a[1], square = dx * dx + dy * dy;
    const s = square > 0 ? Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / square)) : 0;
    return Math.hypot(x - a[0] - s * dx, y - a[1] - s * dy);
  }

  function along(a, b) {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    const c = length > 0 ? (b[0] - a[0]) / length : 1, s = length > 0 ? (b[1] - a[1]) / length : 0;
    return {length, at: (u, left) => [a[0] + c * u + s * left, a[1] + s * u - c * left]};
  }

  function spring(a, b, radius, aside) {
    const way = along(a, b), lead = Math.min(0.2 * way.length, 2 * radius), middle = way.length - 2 * lead;
    const coils = Math.max(4, Math.min(24, Math.floor(middle / (0.9 * radius)) || 4));
    const spots = [way.at(0, 0), way.at(0, aside), way.at(lead, aside)];
    for (let i = 0; i < coils; ++i) {
      spots.push(way.at(lead + middle * (i + 0.5) / coils, aside + (i % 2 ? -radius : radius)));
    }
    return spots.concat([way.at(way.length - lead, aside), way.at(way.length, aside), way.at(way.length, 0)]);
  }

  function damper(a, b, radius, aside) {
    const way = along(a, b), m = 0.5 * way.length, cup = Math.min(1.6 * radius, 0.3 * way.length);
    return [[way.at(0, 0), way.at(0, aside), way.at(m - cup, aside)],
            [way.at(m + cup, aside + radius), way.at(m - cup, aside + radius),
             way.at(m - cup, aside - radius), way.at(m + cup, aside - radius)],
            [way.at(m, aside + 0.7 * radius), way.at(m, aside - 0.7 * radius)],
            [way.at(m, aside), way.at(way.length, aside), way.at(way.length, 0)]];
  }

  return {paint, fromSegment};
})();
