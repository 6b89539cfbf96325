"""The live view: a page on the loopback that shows a run while it happens, and by which it is steered.

    run --socket pair--> server.py, a process of its own --HTTP, WebSocket--> page/ in browsers on this machine
                                                         --Foxglove's protocol--> Foxglove, if asked for

The run is asked for an update some ten times a second, as long as somebody watches, and answers between two windows.
It never waits for the server, nor the server for a page: who does not read is dropped.
"""
