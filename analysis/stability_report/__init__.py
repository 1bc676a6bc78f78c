"""Parts of the stability report: the numbers, the study behind them, pages and plots."""
