"""A table is plain data: columns are chosen by name, and what is left out is said."""

from support.small_tables import ROWS, made


def test_columns_are_chosen_by_name_and_in_the_order_asked_for():
    chosen = made().only("mark", "absent", "body")
    assert [column.name for column in chosen.columns] == ["mark", "body"] and chosen.rows[0][1] == "cup|lid"


def test_a_long_table_says_how_much_it_leaves_out_in_a_note():
    cut = made().first(1, "and {} more")
    assert cut.rows == tuple(ROWS[:1]) and cut.notes[-1] == "and 1 more" and made().first(2, "{}") == made()
