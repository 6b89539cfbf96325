"""Firmware in C behind `marconet_board.h`: one folder for each, with its C files and `firmware.toml`.

    firmware.toml --> board_ids.h         (description.py, ids_header.py)
    *.c *.h       --> shared library      (build.py, host/)
    library + Board --> a program         (program.py, host/library.py)
"""
