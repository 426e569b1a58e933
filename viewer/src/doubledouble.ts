// Numbers of twice the precision, an unevaluated sum of two doubles: the simulator's, operation by operation
// (crates/carom/src/rotation/double_double.rs), so that a rotation comes out as it did there.

/** high + low, where high is the double nearest to the sum. */
export class DoubleDouble {
  constructor(readonly high: number, readonly low = 0) {}

  static readonly ZERO = new DoubleDouble(0);
  static readonly ONE = new DoubleDouble(1);
  static readonly INVERSE_TWO_PI = new DoubleDouble(0.15915494309189535, -9.839338337591243e-18);

  /** The product of two doubles, exactly. */
  static product(a: number, b: number): DoubleDouble {
    return new DoubleDouble(a * b, productError(a, b));
  }

  /** The difference of two doubles, exactly. */
  static difference(a: number, b: number): DoubleDouble {
    return new DoubleDouble(a - b, sumError(a, -b));
  }

  plus(other: DoubleDouble): DoubleDouble {
    const sum = this.high + other.high;
    const low = this.low + other.low;
    const next = quick(sum, sumError(this.high, other.high) + low);
    return quick(next.high, sumError(this.low, other.low) + next.low);
  }

  minus(other: DoubleDouble): DoubleDouble {
    return this.plus(other.negative());
  }

  times(other: DoubleDouble | number): DoubleDouble {
    if (typeof other === "number") return quick(this.high * other, productError(this.high, other) + this.low * other);
    return quick(this.high * other.high, productError(this.high, other.high) + (this.high * other.low + this.low * other.high));
  }

  over(other: DoubleDouble): DoubleDouble {
    const quotient = this.high / other.high;
    return quick(quotient, this.minus(other.times(quotient)).high / other.high);
  }

  negative(): DoubleDouble {
    return new DoubleDouble(-this.high, -this.low);
  }

  abs(): DoubleDouble {
    return this.high < 0 ? this.negative() : this;
  }

  squared(): DoubleDouble {
    return this.times(this);
  }

  /** Of a number of at least 0. */
  sqrt(): DoubleDouble {
    if (this.high <= 0) return DoubleDouble.ZERO;
    const root = Math.sqrt(this.high);
    return quick(root, this.minus(DoubleDouble.product(root, root)).high / (2 * root));
  }

  /** Times a power of two. */
  scaled(power: number): DoubleDouble {
    return new DoubleDouble(this.high * power, this.low * power);
  }
}

/** What rounding leaves out of a + b (Knuth). */
export function sumError(a: number, b: number): number {
  const sum = a + b;
  const part = sum - a;
  return (a - (sum - part)) + (b - part);
}

/** What rounding leaves out of a b (Dekker). */
export function productError(a: number, b: number): number {
  const scaledA = 134217729 * a;
  const highA = scaledA - (scaledA - a);
  const lowA = a - highA;
  const scaledB = 134217729 * b;
  const highB = scaledB - (scaledB - b);
  const lowB = b - highB;
  return ((highA * highB - a * b) + highA * lowB + lowA * highB) + lowA * lowB;
}

/** A sum where |a| ≥ |b|. */
function quick(a: number, b: number): DoubleDouble {
  const sum = a + b;
  return new DoubleDouble(sum, b - (sum - a));
}
