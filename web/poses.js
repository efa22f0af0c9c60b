// Poses of a picture's bodies: between two frames, at a time, as matrices (scene.js has the format).
'use strict';
const LoopbenchPoses = (() => {
  const TURN = 2 * Math.PI;
  const stride = (picture) => (picture.planar ? 3 : 7);

  // Between frames floor(at) and the next: straight ways, shortest turns.
  function between(picture, frames, at) {
    const last = frames.length - 1;
    const i = Math.max(0, Math.min(last, Math.floor(at)));
    const a = frames[i], b = frames[Math.min(last, i + 1)], s = Math.max(0, Math.min(1, at - i));
    const step = stride(picture), out = new Float64Array(a.length);
    for (let k = 0; k < a.length; k += step) {
      for (let j = 0; j < step; ++j) out[k + j] = a[k + j] + s * (b[k + j] - a[k + j]);
      if (picture.planar) {
        const turn = b[k + 2] - a[k + 2];
        out[k + 2] = a[k + 2] + s * (turn - TURN * Math.round(turn / TURN));
      } else {
        let dot = 0, size = 0;
        for (let j = 3; j < 7; ++j) dot += a[k + j] * b[k + j];
        for (let j = 3; j < 7; ++j) {
          out[k + j] = (1 - s) * a[k + j] + s * (dot < 0 ? -1 : 1) * b[k + j];
          size += out[k + j] * out[k + j];
        }
        for (let j = 3; j < 7; ++j) out[k + j] /= Math.sqrt(size) || 1;
      }
    }
    return out;
  }

  // The frame, with fraction, of a time among ascending times.
  function frameAt(times, t) {
    let low = 0, high = times.length - 1;
    if (high < 1 || t <= times[0]) return 0;
    if (t >= times[high]) return high;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t) low = middle; else high = middle;
    }
    return low + (t - times[low]) / (times[high] - times[low] || 1);
  }

  // Twelve numbers a body: rotation by rows, position.
  function matrices(picture, poses) {
    const step = stride(picture), n = poses.length / step, X = new Float64Array(12 * n);
    for (let b = 0; b < n; ++b) {
      const k = b * step, m = 12 * b;
      if (picture.planar) {
        const c = Math.cos(poses[k + 2]), s = Math.sin(poses[k + 2]);
        X[m] = c; X[m + 1] = -s; X[m + 3] = s; X[m + 4] = c; X[m + 8] = 1;
        X[m + 9] = poses[k]; X[m + 10] = poses[k + 1];
      } else {
        const w = poses[k + 3], x = poses[k + 4], y = poses[k + 5], z = poses[k + 6];
        X[m] = 1 - 2 * (y * y + z * z); X[m + 1] = 2 * (x * y - z * w); X[m + 2] = 2 * (x * z + y * w);
        X[m + 3] = 2 * (x * y + z * w); X[m + 4] = 1 - 2 * (x * x + z * z); X[m + 5] = 2 * (y * z - x * w);
        X[m + 6] = 2 * (x * z - y * w); X[m + 7] = 2 * (y * z + x * w); X[m + 8] = 1 - 2 * (x * x + y * y);
        for (let j = 0; j < 3; ++j) X[m + 9 + j] = poses[k + j];
      }
    }
    return X;
  }

  // A place [body, x, y, z] with its offset in ground axes, as a point.
  function placed(X, place, i, offsets, out) {
    const m = 12 * place[i], x = place[i + 1], y = place[i + 2], z = place[i + 3], o = i / 4 * 3;
    for (let j = 0; j < 3; ++j) {
      out[j] = X[m + 9 + j] + X[m + 3 * j] * x + X[m + 3 * j + 1] * y + X[m + 3 * j + 2] * z +
               (offsets ? offsets[o + j] : 0);
    }
    return out;
  }

  // The path of each named point of a picture through frames: x, y, z of every frame.
  function paths(picture, frames) {
    const all = picture.points.map(() => new Float64Array(3 * frames.length)), p = [0, 0, 0];
    frames.forEach((frame, f) => {
      const X = matrices(picture, frame);
      picture.points.forEach((point, i) => all[i].set(placed(X, point.at, 0, null, p), 3 * f));
    });
    return all;
  }

  return {between, frameAt, matrices, paths, placed};
})();
