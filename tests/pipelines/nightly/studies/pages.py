"""The pages of evidence."""


def power_page():
    pass


def quiet_page():
    pass
