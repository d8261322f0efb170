"""The pages of evidence."""


def power_page():
    pass


def quiet_page():
    pass


def changes_page():
    pass
