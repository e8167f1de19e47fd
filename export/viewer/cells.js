// SPDX-License-Identifier: GPL-3.0-or-later
// The kinds of cells, numbered as in subvol/mesh/cell_topology.h; a surface is shown as cells of one face.

/// corners: number; edges: corners of each; faces: corners of each, seen from outside counter-clockwise.
export const KINDS = [
  {
    name: "tetrahedron",
    corners: 4,
    edges: [
      [0, 1],
      [1, 2],
      [2, 0],
      [0, 3],
      [1, 3],
      [2, 3],
    ],
    faces: [
      [0, 2, 1],
      [0, 1, 3],
      [1, 2, 3],
      [2, 0, 3],
    ],
  },
  {
    name: "prism",
    corners: 6,
    edges: [
      [0, 1],
      [1, 2],
      [2, 0],
      [0, 3],
      [1, 4],
      [2, 5],
      [3, 4],
      [4, 5],
      [5, 3],
    ],
    faces: [
      [0, 2, 1],
      [3, 4, 5],
      [0, 1, 4, 3],
      [1, 2, 5, 4],
      [2, 0, 3, 5],
    ],
  },
  {
    name: "hexahedron",
    corners: 8,
    edges: [
      [0, 1],
      [1, 2],
      [2, 3],
      [3, 0],
      [0, 4],
      [1, 5],
      [2, 6],
      [3, 7],
      [4, 5],
      [5, 6],
      [6, 7],
      [7, 4],
    ],
    faces: [
      [0, 3, 2, 1],
      [4, 5, 6, 7],
      [0, 1, 5, 4],
      [1, 2, 6, 5],
      [2, 3, 7, 6],
      [3, 0, 4, 7],
    ],
  },
  {
    name: "pyramid",
    corners: 5,
    edges: [
      [0, 1],
      [1, 2],
      [2, 3],
      [3, 0],
      [0, 4],
      [1, 4],
      [2, 4],
      [3, 4],
    ],
    faces: [
      [0, 3, 2, 1],
      [0, 1, 4],
      [1, 2, 4],
      [2, 3, 4],
      [3, 0, 4],
    ],
  },
  {
    name: "triangle",
    corners: 3,
    edges: [
      [0, 1],
      [1, 2],
      [2, 0],
    ],
    faces: [[0, 1, 2]],
    flat: true,
  },
  {
    name: "quad",
    corners: 4,
    edges: [
      [0, 1],
      [1, 2],
      [2, 3],
      [3, 0],
    ],
    faces: [[0, 1, 2, 3]],
    flat: true,
  },
];

/// Number of the edge between two corners of a face, for each kind, face, and corner k to k + 1.
export const FACE_EDGES = KINDS.map((kind) =>
  kind.faces.map((face) =>
    face.map((a, k) => {
      const b = face[(k + 1) % face.length];
      return kind.edges.findIndex(([p, q]) => (p === a && q === b) || (p === b && q === a));
    })
  )
);
