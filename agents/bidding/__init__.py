"""Bidding over a radio: a team of sensors deploys one of them for each task, without a center (dissertation, 2.3).

    detected --BID, with the time left--> everybody bids within the window --close--> all choose the greatest bid
    the winner: deploy, AWARD until heard, then a MODE at least every heartbeat      others: watch that it goes on

    waiting --open, or a BID heard--> window open --close, own bid greatest--> deployed --finish--> finished
                                         |  ^                                    | a greater bid by another deployed
              close, another's greatest  v  | silence of all that are deployed   v
                                        held by others <-------------------- let go

Ties go to the lower number. The dissertation takes sensors that are fully connected and synchronized by events; here a
frame may collide, be lost or cut, so what is promised has bounds, derived in `bid_timing`.
"""
