"""Passive robots that agree over links with delays of any length, by waves.

    port.py         the algebra of a wave port: what goes out, which force acts
    incoming_wave.py    one incoming line: the wave in use, and the energy that the line still owes
    passivity.py    whether a linear agent is passive
    network.py      agents, links and delays
    wave_loop.py, output_loop.py    the exact map of a round, with waves and with outputs that are held; jump_loop.py
    robot.py        the program; wave_coupling.py, output_coupling.py: its two ways to use what it hears
    team.py, preparation.py, wave_frame.py      the table [team], its checks, the frames

Sources: R. J. Anderson, M. W. Spong, "Bilateral control of teleoperators with time delay", IEEE Transactions on
Automatic Control 34(5), 1989; G. Niemeyer, J.-J. E. Slotine, "Stable adaptive teleoperation", IEEE Journal of Oceanic
Engineering 16(1), 1991; for packets S. Stramigioli, C. Secchi, A. J. van der Schaft, C. Fantuzzi, "Sampled data systems
passivity and discrete port-Hamiltonian systems", IEEE Transactions on Robotics 21(4), 2005.
"""
