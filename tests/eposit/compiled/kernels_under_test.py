"""Functions that use everything that kernels may have, for tests that compare them with plain Python."""

import math

from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, TRUTH, WHOLE, W, compiled, four, four_at_once, part, total

TENTH, THREE, FAR = 0.1, 3, -7


@compiled(NUMBER, W, WHOLE)
def arithmetic(w, n):
    """Sums, products, quotients, powers, constants of the module and of `math`."""
    a, b = w[0], w[n - 1]
    c = d = -a
    c += TENTH * b
    d -= b / a
    d *= 1e-3 + THREE
    w[n] = n // 2 + n % 3
    w[n + 1] += FAR
    return c**2 + abs(d) ** 0.3 - math.pi * math.copysign(a, b) + int(b * 10.0)


@compiled(NUMBER, W, WHOLE)
def functions(w, n):
    """Functions of one and of two numbers."""
    total = 0.0
    for i in range(n):
        x = w[i]
        total += math.sin(x) + math.cos(x) + math.tan(x) + math.atan(x) + math.log(abs(x)) + math.sqrt(x * x)
        total += math.acos(x / 100.0) * math.atan2(x, TENTH) + min(x, TENTH) - max(TENTH, x) + max(i, 1) + min(i, 2)
    return total


@compiled(WHOLE, W, WHOLE)
def loops(w, n):
    """Loops of all kinds, left and gone on with in their middle; the last value of a counter stays."""
    count, k = 0, 0
    for i in range(n):
        if w[i] < 0.0:
            continue
        for j in range(i, n, 2):
            if w[j] > 2.0:
                break
            count += 1
        count += 10
    for j in range(n - 1, -1, -2):
        count += 100 * j
    while k < n and w[k] != 0.25:
        k += 1
        if k == 5:
            break
    w[n] = 1000 * j + i
    return 10000 * k + count


@compiled(TRUTH, W, WHOLE, TRUTH)
def _tests(w, n, ask):
    inside = 0.0 < w[0] <= w[1] < math.inf
    if not ask or (n > 3 and w[2] > w[3]):
        inside = not inside
    elif n in (2, THREE) and w[0] == w[0]:
        return True
    return inside or n >= 10 or w[0] * 0.0 != 0.0


@compiled(WHOLE, W, WHOLE, WHOLE)
def tests(w, n, ask):
    """Comparisons in a chain, `and`, `or`, `not`, `in`; what is not asked for is not read."""
    return 1 if _tests(w, n, ask == 1) else 0


@part((NUMBER, WHOLE), NUMBER, NUMBER)
def two(x, y):
    """Two values, by one of two ways."""
    if x < y:
        return x / y, 1
    return (y if y < -1.0 else x), 2


@compiled(NOTHING, W, WHOLE)
def exchange(w, n):
    """Values exchanged, and several at once from another function."""
    w[0], w[n - 1] = w[n - 1], w[0]
    x, which = two(w[0], w[1])
    w[n], w[n + 1] = x, which
    if which == 1:
        return
    w[n] = two(w[1], w[0])[0]


@compiled(NUMBER, W, WHOLE)
def calls(w, n):
    """Another function of the same array, and a whole number where a number is wanted."""
    exchange(w, n)
    return two(w[n], n)[0] + loops(w, n)


@compiled(NUMBER, W, WHOLE)
def lanes(w, n):
    """Four numbers side by side, with each other, with numbers and with whole numbers; one of them, and their sum."""
    a = b = four(w[0], w[1], w[2], w[3])
    a += 0.5 * b - n / b
    b = -(a**2) / w[0] + four(w[n - 1], 2, TENTH, n)
    return total(a * b) + b[n // 3]


@part(NUMBER, NUMBER)
def bent(x):
    """One of two values, and a root."""
    return math.sqrt(x) + min(x, 1.0) if x > 0.25 else abs(x) / 3.0


bent_of_four = four_at_once(bent)


@compiled(NOTHING, W, POINTER)
def apart(w, out):
    """At out (3, 4): a function of four numbers, the same of each of them, and one that returns several values."""
    a = four(w[0], w[1], w[2], w[3])
    together, each = bent_of_four(a), bent(a)
    x, which = two(a, w[4])
    for i in range(4):
        out[i], out[4 + i], out[8 + i] = together[i], each[i], x[i] + 10.0 * which[i]
