"""A DVA of regions: several DVAs serve one site together.

`RegionalDva` is a DVA among others. It serves regions (`division`), gives and takes help (`help`),
lets devices go that have crossed a border (`borders`), and goes on where another one has died
(`takeover`). The fence between DVAs is the registration of each device.
"""
