"""Numbers of things in words: 1 run, 2 runs."""


def counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
