// Unit quaternions (w, x, y, z) that turn vectors from a body's axes to the world's.

import type { Quaternion, Vector } from "./recording";

/** First q, then p. */
export function product(p: Quaternion, q: Quaternion): Quaternion {
  const [pw, px, py, pz] = p;
  const [qw, qx, qy, qz] = q;
  return [
    pw * qw - px * qx - py * qy - pz * qz,
    pw * qx + px * qw + py * qz - pz * qy,
    pw * qy - px * qz + py * qw + pz * qx,
    pw * qz + px * qy - py * qx + pz * qw,
  ];
}

/** The turn back. */
export function conjugate([w, x, y, z]: Quaternion): Quaternion {
  return [w, -x, -y, -z];
}

export function rotated([w, x, y, z]: Quaternion, [a, b, c]: Vector): Vector {
  // v + 2 u × (u × v + w v)
  const [p, q, r] = [y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c];
  return [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)];
}

/** The angle between two orientations (rad), whatever their signs. */
export function angleBetween(p: Quaternion, q: Quaternion): number {
  const [, x, y, z] = product(conjugate(p), q);
  const w = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
  return 2 * Math.atan2(Math.hypot(x, y, z), Math.abs(w));
}
