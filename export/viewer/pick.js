// SPDX-License-Identifier: GPL-3.0-or-later
// Finds what a ray meets first.

/// Triangles: {positions, index or null, centers or null}. accept(x, y, z): false where nothing is drawn.
/// Returns {t, triangle, point} with the smallest t > 0, or null. Cells shrunk toward their centers are met where they
/// are drawn.
export function first_hit({ positions, index, centers }, shrink, origin, direction, accept) {
  const count = index ? index.length / 3 : positions.length / 9,
    corner = [0, 0, 0, 0, 0, 0, 0, 0, 0];
  const [ox, oy, oz] = origin,
    [dx, dy, dz] = direction;
  let best = null,
    nearest = Infinity;
  for (let triangle = 0; triangle < count; ++triangle) {
    for (let k = 0; k < 3; ++k) {
      const p = 3 * (index ? index[3 * triangle + k] : 3 * triangle + k);
      for (let i = 0; i < 3; ++i)
        corner[3 * k + i] = centers ? centers[p + i] + shrink * (positions[p + i] - centers[p + i]) : positions[p + i];
    }
    const [ax, ay, az, bx, by, bz, cx, cy, cz] = corner;
    const e1x = bx - ax,
      e1y = by - ay,
      e1z = bz - az,
      e2x = cx - ax,
      e2y = cy - ay,
      e2z = cz - az;
    const px = dy * e2z - dz * e2y,
      py = dz * e2x - dx * e2z,
      pz = dx * e2y - dy * e2x;
    const det = e1x * px + e1y * py + e1z * pz;
    if (det === 0) continue;
    const sx = ox - ax,
      sy = oy - ay,
      sz = oz - az,
      u = (sx * px + sy * py + sz * pz) / det;
    if (!(u >= 0 && u <= 1)) continue;
    const qx = sy * e1z - sz * e1y,
      qy = sz * e1x - sx * e1z,
      qz = sx * e1y - sy * e1x;
    const v = (dx * qx + dy * qy + dz * qz) / det;
    if (!(v >= 0 && u + v <= 1)) continue;
    const t = (e2x * qx + e2y * qy + e2z * qz) / det;
    if (!(t > 0 && t < nearest)) continue;
    const point = [ox + t * dx, oy + t * dy, oz + t * dz];
    if (!accept(...point)) continue;
    nearest = t;
    best = { t, triangle, point };
  }
  return best;
}

/// The side that a triangle belongs to, by the first triangles of all sides.
export function side_of(first_triangles, triangle) {
  let low = 0,
    high = first_triangles.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (first_triangles[middle] <= triangle) low = middle;
    else high = middle;
  }
  return low;
}
