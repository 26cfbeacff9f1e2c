"""Smoothing with forces at ports: motion follows the recordings, and what the equations lack shows as a force there.

A plant that is run from a recording's start has to have its phases right before anything fits; here nothing is run.
The motion of floor, base and joints is sought by local coefficients, beside the rig's numbers, such that readings
agree to their noise and balances of forces to a force of known size (weak constraints, errors in equations). All is
nearly quadratic: some steps of Gauss and Newton. What pulls a number is taken along the motion that the model has by
itself, which holds no noise: along the smoothed one all that scales a balance would shrink. A left-out effect is then
a column along that motion in the row of its port, and every effect of the catalogue at every port is scored by one
factorisation, beside all numbers.

    basis.py      motion by local coefficients
    balance.py    readings and forces that a motion needs, by inverse dynamics
    drive.py      what motor and gear give for a field
    columns.py    columns of rows that are zero in most of them
    problem.py    rows, unknowns, priors of a campaign
    course.py     a motion as signals of the plant, and what effects along it do
    fit.py        Gauss and Newton
    intensities.py  how large the forces are, from what repeats differ by
    lines.py      tones and orders to try
    screen.py     effects as columns: what each would take of the cost
    search.py     effects that recordings show, fitted and held out
    as_plant.py   the numbers as the plant has them

Begin with `search.py`. What it proposes is judged in the plant (`selection/rounds.py`).
"""
