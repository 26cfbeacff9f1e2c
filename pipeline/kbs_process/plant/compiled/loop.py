"""The time loop that every generated plant module ends with, as text: it calls that module's own `step`."""

LOOP = '''@compiled
def field_at(time, cycle, knots, fields, joint):
    """Field position of a motor, in microsteps, linear between the cycles' starts."""
    share = (time - knots[cycle]) / (knots[cycle + 1] - knots[cycle])
    return fields[cycle, joint] + share * (fields[cycle + 1, joint] - fields[cycle, joint])


@compiled
def cycle_of(time, cycle, known, knots):
    """The cycle that a time is in, of those whose fields are known; `cycle` is one nearby."""
    while cycle > 0 and knots[cycle] > time:
        cycle -= 1
    while cycle < known - 1 and knots[cycle + 1] <= time:
        cycle += 1
    return cycle


@compiled
def follow(time, end, cursor, knots):
    """Move the cursor to the cycle of a step's beginning; return the cycle of its end."""
    while cursor[0] < cursor[1] - 1 and knots[cursor[0] + 1] <= time:
        cursor[0] += 1
    ahead = cursor[0]
    while ahead < cursor[1] - 1 and knots[ahead + 1] <= end:
        ahead += 1
    return ahead


@compiled
def control(
    cycle, angle, closed, recorded, latency, command, rate, encoder, readings, gains, sums, knots, fields
):
    """Read the encoders at the start of a cycle and set the field's motion over it.

    `encoder` rows: code in rad, offset in rad; `gains` rows: Kp, Ki, microsteps a rad of output.
    """
    for j in range(angle.shape[0]):
        if not recorded:
            code = encoder[0, j]
            reading = angle[j] + encoder[1, j]
            readings[cycle, j] = np.floor(reading / code + 0.5) * code if code > 0.0 else reading
        if closed:
            span = knots[cycle + 1] - knots[cycle]
            error = command[cycle, j] - readings[max(0, cycle - latency), j]
            sums[j] += error
            turn = rate[cycle, j] * span + gains[0, j] * error + gains[1, j] * span * sums[j]
            fields[cycle + 1, j] = fields[cycle, j] + gains[2, j] * turn


@njit(cache=True, nogil=True, error_model="numpy")
def advance(
    first, count, H, p, x, cursor, closed, recorded, latency, command, rate, encoder, readings, gains, sums,
    knots, fields, per_sample, held, low_pass, drive_in, amplifier, wrench, angle_rate, angle_first, angle, states,
):
    """Advance `count` steps from step number `first`; return how many samples of the angles were taken.

    Step i covers i H to (i + 1) H of the recording's time. `cursor` holds the last step's cycle and the
    number of cycles controlled, `held` the wrench of the step before. Without an amplifier (`drive_in` is empty) a
    sample is the mean of the two steps beside it. `states`, unless it is empty, gets the state at each sample, with the
    fields behind it.
    """
    n = angle.shape[1]
    order = drive_in.shape[0]
    field_0 = np.empty(n)
    field_1 = np.empty(n)
    now = np.empty(n)
    old = np.empty(order)
    q = 6  # offset of the joint angles in the state
    samples = 0
    taken = 0
    for i in range(first, first + count):
        time = i * H
        end = (i + 1) * H
        while cursor[1] < knots.shape[0] - 1 and knots[cursor[1]] < end - 1e-3 * H:
            lag = knots[cursor[1]] - time
            for j in range(n):
                now[j] = x[q + j] + lag * x[q + n + j]
            control(
                cursor[1], now, closed, recorded, latency, command, rate, encoder, readings, gains, sums,
                knots, fields,
            )
            cursor[1] += 1
        ahead = follow(time, end, cursor, knots)
        for j in range(n):
            field_0[j] = field_late(time, cursor[0], cursor[1], knots, fields, j, p)
            field_1[j] = field_late(end, ahead, cursor[1], knots, fields, j, p)
            now[j] = x[q + j]
        # Samples fall on step ends to within rounding; half a nanosecond decides.
        sampling = i % per_sample == 0
        if sampling and order > 0:
            for c in range(6):
                wrench[samples, c] = amplifier[c, order - 1]
        if sampling and states.shape[0] > 0:
            for c in range(x.shape[0]):
                states[samples, c] = x[c]
            for j in range(n):
                states[samples, x.shape[0] + j] = arriving(j, field_0[j], field_1[j], time, H, p)
        force = step(x, field_0, field_1, time, H, p)
        if sampling:
            if order == 0:
                for c in range(6):
                    wrench[samples, c] = 0.5 * (held[c] + force[c])
            samples += 1
        for c in range(6):
            held[c] = force[c]
            for a in range(order):
                old[a] = amplifier[c, a]
            for a in range(order):
                value = drive_in[a] * force[c]
                for b in range(order):
                    value += low_pass[a, b] * old[b]
                amplifier[c, a] = value
        while taken < angle.shape[0]:
            due = (angle_first + taken) / angle_rate
            if due > end - 5e-10:
                break
            share = (due - time) / H
            for j in range(n):
                angle[taken, j] = now[j] + share * (x[q + j] - now[j])
            taken += 1
    return taken
'''
